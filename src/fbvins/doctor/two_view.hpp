// SPDX-License-Identifier: Apache-2.0
// The motion between two images of one camera, from features whose depths nobody knows: the rotation, and the direction of the
// translation, which has length 1. Pure functions, any thread.
//
//   if (estimate_without_depths(camera, pair)) use(pair.turn, pair.p_CaCb);
#pragma once

#include <vector>

#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

/// Sets the pair's motion; features without a ray are left out. False where the features do not fit one motion.
bool estimate_without_depths(const Camera& camera, FramePair& pair);

/// Directions of features in both images, of length 1, a's turned into b.
struct RayPairs {
  std::vector<Vec3> a, b;
};

/// The direction of the translation, in b: that in which the features lie in one plane with both their rays, against what noise
/// would make of them.
Vec3 translation_direction(const RayPairs& rays);

/// How far a feature is from its epipolar plane, rad: `a` and `b` are directions of length 1 in b, `p` that of the translation in
/// b. A feature nearer to p than a tenth of a radian counts as if it were as far.
double epipolar_angle(const Vec3& a, const Vec3& b, const Vec3& p);

}  // namespace fbvins
