// SPDX-License-Identifier: Apache-2.0
// The 256 point pairs that BRIEF compares (paper eq. 5), chosen by a small deterministic procedure from a
// statistical model of images instead of a table learned from somebody's photographs.
//
// Model: grey values are a stationary Gaussian field with covariance C(r) = 1 / (1 + (r/L)^2). For a pair (a, b)
// the bit is sign(I(a) - I(b)), so the correlation of two bits follows from C, and turning every patch
// to its intensity centroid gives I(a) - I(b) a known mean, hence the bit a known bias. As in ORB, pairs
// are taken in order of least bias, each unless it is too correlated with one taken before; the limit rises until
// 256 are found. Pure function, same table on every platform (only + * / sqrt).
#pragma once

#include <array>
#include <cstdint>

namespace fbvins {

inline constexpr int kOrbRadius = 15;      ///< disc of the intensity centroid, px of the level
inline constexpr int kPatternRadius = 13;  ///< points of the pairs lie within, px of the level

struct PointPair {
  std::int8_t ax = 0, ay = 0, bx = 0, by = 0;
};

std::array<PointPair, 256> make_orb_pattern();

/// The pattern, computed at first use.
const std::array<PointPair, 256>& orb_pattern();

}  // namespace fbvins
