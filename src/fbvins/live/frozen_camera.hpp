// SPDX-License-Identifier: Apache-2.0
// A hung camera or driver often repeats its last image with new stamps. Two real images never agree in every pixel.
#pragma once

#include <cstring>
#include <memory>
#include <utility>

#include "fbvins/types/image.hpp"

namespace fbvins {

class FrozenCamera {
 public:
  /// True if this image equals the one before, to the last bit.
  bool is_repeated(const std::shared_ptr<const Image>& image) {
    if (image == nullptr) return false;
    const std::shared_ptr<const Image> before = std::exchange(before_, image);
    return before != nullptr && same(before->view(), image->view());
  }

 private:
  static bool same(ImageView a, ImageView b) {
    if (a.width != b.width || a.height != b.height) return false;
    for (int y = 0; y < a.height; ++y)
      if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
    return true;
  }
  std::shared_ptr<const Image> before_;
};

}  // namespace fbvins
