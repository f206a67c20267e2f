// SPDX-License-Identifier: Apache-2.0
// Where a level frame of poses lies in the frame of anchors, and whether they determine it: position and heading, by the
// largest set of anchors that agree (docs/derivations/loop.md, L24). Pure function; the same anchors give the same bits.
//
//   std::vector<AnchoredPose<M>> poses = ...;                        // of the keyframes that have anchors
//   if (auto fit = fit_anchors(poses, T_XB.p)) use(Pose<A, X>{fit->q_AX, fit->p_AX});
#pragma once

#include <optional>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/loop/map_frame.hpp"
#include "fbvins/loop/partial_pose.hpp"

namespace fbvins {

/// A pose in a level frame X, and what an anchor says of it in A.
struct AnchoredPose {
  Quat q_XB = Quat::Identity();
  Vec3 p_XB = Vec3::Zero();
  PartialPose measured;  ///< widened by what the poses have drifted since
  KeyframeId keyframe;
  double tilt_rad = kTilt_rad;  ///< standard deviation of its roll and pitch
};

struct AnchorFit {
  Quat q_AX = Quat::Identity();  ///< about z
  Vec3 p_AX = Vec3::Zero();
  Mat4 covariance = Mat4::Zero();  ///< of the position in A of the point that was asked for, and of the heading
  int inliers = 0;
};

/// Of the point p_X, where the body is now, position and heading must be certain to 0.1 m and 1.5 degrees, and three anchors of
/// two keyframes, and of all that there are three in five, must agree.
std::optional<AnchorFit> fit_anchors(const std::vector<AnchoredPose>& poses, const Vec3& p_X);

}  // namespace fbvins
