// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/published_pose.hpp"

#include <cmath>

#include "fbvins/geometry/symmetric.hpp"

namespace fbvins {
namespace {

/// The perturbation that takes a to b (conventions, R3 and R4).
Vec6 difference(const Pose<W, B>& b, const Pose<W, B>& a) {
  Vec6 d;
  d << b.p - a.p, so3_log((a.q.conjugate() * b.q).normalized());
  return d;
}

/// `pending`, shortened to at most `limit` (W18).
Vec3 limited(const Vec3& pending, double limit) {
  const double size = pending.norm();
  return size > limit ? Vec3((limit / size) * pending) : pending;
}

/// Standard deviation of the attitude's tilt about its less certain axis, from the covariance of dtheta in B.
double tilt_sigma_of(const Quat& q_WB, const Mat3& covariance) {
  const Mat3 R = q_WB.toRotationMatrix();
  const Mat2 level = (R * covariance * R.transpose()).topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, largest_eigenvalue(level)));
}

}  // namespace

void PublishedPose::follow(const std::optional<Pose<B, B>>& motion, const Pose<W, B>& level) {
  if (!started_ || !motion || max_step_m_ <= 0) {
    started_ = true;
    T_WB_ = level;
    pending_.setZero();
    return;
  }
  const Pose<W, B> moved = T_WB_ * *motion;
  const Vec6 pending = difference(level, moved);
  T_WB_ =
      moved.boxplus(limited(pending.head<3>(), max_step_m_), limited(pending.tail<3>(), kRotationPerStep_radpm * max_step_m_));
  pending_ = difference(level, T_WB_);
}

void PublishedPose::fill(const NavState<W>& level, Odometry& out) {
  const Quat turn = (T_WB_.q * level.T_FB.q.conjugate()).normalized();  // from level to the published attitude
  out.T_WB = T_WB_;
  out.v_WB = turn * level.v_FB;
  out.up_W = turn * Vec3::UnitZ();
  if (!out.pose_covariance.isZero(0)) {
    const Vec3 pending_v = level.v_FB - out.v_WB;
    out.pose_covariance += pending_ * pending_.transpose();
    out.velocity_covariance += pending_v * pending_v.transpose();
    tilt_sigma_rad_ = tilt_sigma_of(T_WB_.q, out.pose_covariance.bottomRightCorner<3, 3>());
  }
  out.tilt_sigma_rad = tilt_sigma_rad_;
  out.level = tilt_sigma_rad_ > 0 && tilt_sigma_rad_ < kLevelSigma_rad;
}

}  // namespace fbvins
