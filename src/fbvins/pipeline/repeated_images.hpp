// SPDX-License-Identifier: Apache-2.0
// Images that a camera, a driver or a recording delivers again with a new stamp. A hung one repeats its last image, or the last
// few of its buffers in turns. Two real images never agree in every pixel; black and white ones do, and are of as little use.
//
// Where nothing moves and nothing is noisy, as in a simulator, equal images are rightly equal. In what is not a live camera an
// image is therefore repeated only where the vehicle has turned since; once that was seen, a camera's images that equal the one
// before are, too. Images of a single grey, as of a covered lens, say nothing there.
//
//   if (!repeated.take_out(packet.frame, packet.imu)) ...   // none of its images was left
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// The last 32 images of a camera that were not repeated.
class ImageHistory {
 public:
  struct Seen {
    std::uint64_t fingerprint;
    Quat R_B0B = Quat::Identity();
    Time t = {};
  };
  /// The newest one that is the same.
  const Seen* find(std::uint64_t fingerprint) const;
  void add(const Seen& seen);
  bool is_newest(const Seen* seen) const { return seen == &seen_.back(); }
  void clear() { seen_.clear(); }

  /// Of a live camera: true if this image is one of them; else it is added.
  bool is_repeated(const std::shared_ptr<const Image>& image);

 private:
  std::deque<Seen> seen_;
};

class RepeatedImageFilter {
 public:
  /// Takes repeated images out of the frame. `since`: readings from the last frame for which this was true, empty without.
  /// False if the frame had images and has none any more.
  bool take_out(StereoFrame& frame, const ImuSegment& since);
  int count() const { return count_; }

 private:
  struct OfCamera {
    ImageHistory seen = {};
    bool repeats = false;
  };
  bool is_repeated(OfCamera& camera, const Image& image, const Quat& R_B0B, Time t);

  std::vector<OfCamera> cameras_;
  Quat R_B0B_ = Quat::Identity();  ///< of the last frame, by the gyroscope
  int count_ = 0;
};

}  // namespace fbvins
