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
/// delivered a newer one, or several of its own have come since. One thread at a time.
class StereoPairs {
 public:
  /// camera: 0 left, 1 right. Stamps of one camera ascend; one that does not is dropped. After it, next() until that is empty.
  void add(int camera, Time t, std::shared_ptr<const Image> image);
  std::optional<StereoFrame> next();

 private:
  struct Waiting {
    Time t;
    std::shared_ptr<const Image> image;
  };
  std::array<std::deque<Waiting>, 2> waiting_;
};

}  // namespace fbvins
