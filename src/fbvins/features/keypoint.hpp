// SPDX-License-Identifier: Apache-2.0
// A feature of an image: position, scale, orientation and a descriptor of 256 bits.
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

/// How clearly comparisons of grey values were decided: the difference over the root mean square of all 256, in units of
/// kMarginUnit, saturated. of_bit is positive where the bit is set: its signs are the descriptor. `around` is the same of a
/// pattern twice as wide and smoothed twice as much: less noise, more surroundings, less that survives a change of view.
struct Margins {
  std::array<std::int8_t, 256> of_bit{};
  std::array<std::int8_t, 256> around{};
  bool operator==(const Margins&) const = default;
};
inline constexpr float kMarginUnit = 1.0f / 32;
inline constexpr int kMarginsPerFeature = 512;
static_assert(sizeof(Margins) == kMarginsPerFeature);  // the rows of the booster's input

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
  std::vector<Margins> margins;  ///< of the descriptors as extracted, before any stage changed them; only where asked for

  std::size_t size() const { return keypoints.size(); }
  void clear() {
    keypoints.clear();
    descriptors.clear();
    margins.clear();
  }
};

}  // namespace fbvins
