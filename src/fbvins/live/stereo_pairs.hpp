// SPDX-License-Identifier: Apache-2.0
// Pairs the images of two separate camera streams by their stamps.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>

#include "fbvins/types/image.hpp"

namespace fbvins {

/// Frames leave in order of time. An image whose partner is lost leaves alone as soon as that is certain: the other camera has
/// delivered a newer one, or several of its own have come since. Where the images of both never meet, the cameras have no common
/// trigger: then each left image has the right one that is nearest to a quarter of an interval before it, with its offset.
/// One thread at a time.
class StereoPairs {
 public:
  /// camera: 0 left, 1 right. Stamps of one camera ascend; one that does not is dropped. After it, next() until that is empty.
  void add(int camera, Time t, std::shared_ptr<const Image> image);
  std::optional<StereoFrame> next();
  bool without_trigger() const { return apart_ >= kApart; }

 private:
  static constexpr int kApart = 20;  // images in a row that leave alone, while both cameras deliver
  struct Waiting {
    Time t;
    std::shared_ptr<const Image> image;
  };
  static Waiting take(std::deque<Waiting>& from);
  std::optional<StereoFrame> next_of_pairs();
  std::optional<StereoFrame> next_without_trigger();
  bool partners_are_there(Time left) const;

  std::array<std::deque<Waiting>, 2> waiting_;
  std::array<std::optional<Time>, 2> newest_;
  std::array<Duration, 2> interval_;  // the last one of each camera
  int apart_ = 0;
};

}  // namespace fbvins
