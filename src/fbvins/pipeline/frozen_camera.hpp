// SPDX-License-Identifier: Apache-2.0
// A hung camera or driver repeats its last image, or the last few of its buffers in turns, with new stamps. Two real images never
// agree in every pixel; black and white ones do, and are of as little use.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>

#include "fbvins/types/image.hpp"

namespace fbvins {

/// Of every eighth row: multiply and fold, eight bytes at a time.
inline std::uint64_t image_fingerprint(ImageView image) {
  std::uint64_t hash =
      0x9e3779b97f4a7c15ULL ^ (static_cast<std::uint64_t>(image.width) << 32) ^ static_cast<std::uint64_t>(image.height);
  const auto mix = [&](std::uint64_t word) {
    hash = (hash ^ word) * 0xd6e8feb86659fd93ULL;
    hash ^= hash >> 32;
  };
  for (int y = 0; y < image.height; y += 8) {
    const std::uint8_t* row = image.row(y);
    int x = 0;
    for (; x + 8 <= image.width; x += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, row + x, 8);
      mix(word);
    }
    for (; x < image.width; ++x) mix(row[x]);
  }
  return hash;
}

class FrozenCamera {
 public:
  /// True if this image is one of the last 32 that were not repeated.
  bool is_repeated(const std::shared_ptr<const Image>& image) {
    if (image == nullptr) return false;
    const std::uint64_t now = image_fingerprint(image->view());
    for (std::size_t i = 0; i < count_; ++i)
      if (seen_[i] == now) return true;
    seen_[next_] = now;
    next_ = (next_ + 1) % seen_.size();
    count_ = std::min(count_ + 1, seen_.size());
    return false;
  }

 private:
  std::array<std::uint64_t, 32> seen_{};
  std::size_t count_ = 0, next_ = 0;
};

}  // namespace fbvins
