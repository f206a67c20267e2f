// SPDX-License-Identifier: Apache-2.0
// Private to bags: the images of a bag's frames, read where they are delivered. One thread at a time.
//
//   BagLoader loader(std::move(bag), path, {{camera, Encoding::ros1, false}}, std::nullopt);
//   loader.find_used_bits(frames);
//   LoadedFrame frame = loader.load(frames.front());
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/bags/bag_messages.hpp"
#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {

class BagLoader : public FrameLoader {
 public:
  struct Sensor {
    Camera camera;  ///< of a depth sensor: that whose pixels it has
    Encoding encoding;
    bool compressed;
    enum Part { whole, left_half, right_half } part = whole;  ///< of messages with two images side by side
  };
  BagLoader(std::unique_ptr<BagReader> bag, std::string name, std::vector<Sensor> cameras, std::optional<Sensor> depth)
      : bag_(std::move(bag)), name_(std::move(name)), cameras_(std::move(cameras)), depth_(std::move(depth)) {}

  /// Cameras of 10 and 12 bits send these in 16, where the upper eight would be almost black: finds how many are used in all
  /// cameras together, from images spread over the recording, so that all its images are scaled alike.
  int find_used_bits(const std::vector<FrameEntry>& frames);
  LoadedFrame load(const FrameEntry& entry) override;

 private:
  template <class T, class Read>
  std::shared_ptr<const T> load_image(const std::string& place, const Sensor& sensor, Read&& read, ImageCounts& counts,
                                      LoadedFrame& loaded);

  std::unique_ptr<BagReader> bag_;
  std::string name_;
  std::vector<Sensor> cameras_;
  std::optional<Sensor> depth_;
  int used_bits_ = 16;
};

}  // namespace fbvins
