// SPDX-License-Identifier: Apache-2.0
// The motion between two images of one camera, from features whose depths nobody knows: the rotation, and the direction of the
// translation, which has length 1. Pure functions, any thread.
//
//   if (estimate_without_depths(camera, pair)) use(pair.turn, pair.p_CaCb);
#pragma once

#include "fbvins/doctor/turn_fit.hpp"

namespace fbvins {

/// Sets the pair's motion; features without a ray are left out. False where the features do not fit one motion.
bool estimate_without_depths(const Camera& camera, FramePair& pair);

/// How far a feature is from its epipolar plane, rad: `a` and `b` are directions of length 1 in b, `p` that of the translation in
/// b. A feature nearer to p than a tenth of a radian counts as if it were as far.
double epipolar_angle(const Vec3& a, const Vec3& b, const Vec3& p);

}  // namespace fbvins
