// SPDX-License-Identifier: Apache-2.0
// Essential matrices through five matches (minimal solver), and the split of one into R and t.
// Pure functions, safe on any thread.
//
//   for (const Mat3& E : five_point(a, b)) score(E);   // b^T E a = 0 for the five pairs
#pragma once

#include <span>
#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// All real essential matrices with (b,1)^T E (a,1) = 0 for five matches in normalised coordinates.
/// Method (D. Nister, "An efficient solution to the five-point relative pose problem", PAMI 2004): E = x E1 + y E2 + z E3 + E4
/// over the null space of the five equations; the ten cubic constraints det E = 0 and 2 E E^T E - tr(E E^T) E = 0, eliminated,
/// leave one polynomial of degree ten in z. Empty when the five matches are degenerate (e.g. no motion).
std::vector<Mat3> five_point(std::span<const Vec2, 5> a, std::span<const Vec2, 5> b);

/// One of the four (R, t), |t| = 1, with E ~ [t]x R: the one with the smaller rotation (neighbouring
/// images). The sign of t is arbitrary: the epipolar constraint does not determine it.
struct RotationTranslation {
  Mat3 R_ba = Mat3::Identity();
  Vec3 t_ba = Vec3::UnitX();
};
RotationTranslation decompose_essential(const Mat3& E);

}  // namespace fbvins
