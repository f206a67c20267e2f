// SPDX-License-Identifier: Apache-2.0
// A point that can be recognised: where it is, how large, how turned, and 256 bits of what it looks like.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct Keypoint {
  Vec2 pixel = Vec2::Zero();  ///< in the raw image (level 0), px
  int level = 0;              ///< of the scale pyramid it was found on
  float scale = 1;            ///< pixels of level 0 a pixel of that level spans
  float angle_rad = 0;        ///< from the x axis towards the y axis (paper eq. 4)
  float score = 0;            ///< Harris (eq. 2), comparable within a level
};

/// 256 comparisons of grey values (paper eq. 5).
struct Descriptor {
  std::array<std::uint64_t, 4> bits{};
  bool operator==(const Descriptor&) const = default;
};

/// How clearly each of a descriptor's comparisons was decided: the difference of the two grey values over the root mean
/// square of all 256, in units of kMarginUnit, saturated. Positive where the bit is set: the signs are the descriptor.
struct Margins {
  std::array<std::int8_t, 256> of_bit{};
  bool operator==(const Margins&) const = default;
};
inline constexpr float kMarginUnit = 1.0f / 32;

/// Number of bits that differ: 0 the same, about 128 unrelated.
inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
  int n = 0;
  for (std::size_t i = 0; i < 4; ++i) n += std::popcount(a.bits[i] ^ b.bits[i]);
  return n;
}

/// The features of one image; descriptor i and margins i belong to keypoint i.
struct OrbFeatures {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  std::vector<Margins> margins;  ///< of the descriptors as extracted, whatever became of them since

  std::size_t size() const { return keypoints.size(); }
  void clear() {
    keypoints.clear();
    descriptors.clear();
    margins.clear();
  }
};

}  // namespace fbvins
