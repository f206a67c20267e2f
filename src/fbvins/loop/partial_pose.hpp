// SPDX-License-Identifier: Apache-2.0
// A measurement of a pose in the map's frame, or of a part of it: a point of the body, its height, or position and attitude
// (docs/derivations/loop.md, L21-L23). A value, and pure functions.
//
//   PartialPose height{.T_AB = {Quat::Identity(), Vec3(0, 0, 1.2)}};
//   height.information(2, 2) = 1 / (0.02 * 0.02);
//   const Vec6 r = residual(height, T_MB.q, T_MB.p);
//   double chi2 = r.dot(height.information * r);
#pragma once

#include "fbvins/core/angle.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/anchor.hpp"

namespace fbvins {

/// Standard deviation of roll and pitch as the odometry estimates them once it has moved.
inline constexpr double kTilt_rad = 0.4 * kDegree;

struct PartialPose {
  Vec3 p_B = Vec3::Zero();          ///< the point of the body whose position is measured
  Pose<A, B> T_AB;                  ///< where that point is, and the body's attitude
  Mat6 information = Mat6::Zero();  ///< of (dp in A, dtheta in B); what is not measured has rows of zero
};

/// (dp in A, dtheta in B) of a pose against what is measured.
Vec6 residual(const PartialPose& measured, const Quat& q_AB, const Vec3& p_AB);
/// Whether it is one: nothing in it is below zero.
bool is_information(const Mat6& information);
/// Square root S of an information that may have rows of zero: S^T S is the information.
Mat6 root_of(const Mat6& information);
/// Information of a measurement whose error is the sum of that of `information` and of one with covariance L L^T.
Mat6 widened(const Mat6& information, const Mat6& L);
/// L of an error of the body's roll and pitch, which displaces the measured point as well. `up_B`: the vertical in the body.
Mat6 tilt_error(const PartialPose& measured, const Quat& q_AB, const Vec3& up_B, double sigma_rad);

/// The same measurement as one of another body, whose pose relative to this one is known with a covariance of (dp in the other,
/// dtheta in this one). The covariance enters as its largest part in any direction, because the other's heading may be unknown.
PartialPose carried(const PartialPose& measured, const Pose<B, B>& T_other_this, const Mat6& covariance);

/// A weak measurement of a pose by itself: it is expected to stay within a metre, where nothing else says more. M is A.
PartialPose about_here(const Pose<M, B>& T_MB);

/// The anchor as a measurement of the body at its own stamp.
PartialPose measurement_of(const Anchor& anchor);

}  // namespace fbvins
