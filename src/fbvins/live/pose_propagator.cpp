// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/pose_propagator.hpp"

#include <cmath>

namespace fbvins {
namespace {

/// A pose propagated for longer is of no use.
constexpr double kLongest_s = 60;
/// A smaller offset is set to zero; m, rad and m/s.
constexpr double kNoOffset = 1e-7;
/// Readings that a correction of the time offset may need again.
constexpr Duration kMostCorrection{100'000'000};

Mat15 covariance_of(const Odometry& o) {
  Mat15 P = Mat15::Zero();
  P.block<6, 6>(nav::p, nav::p) = o.pose_covariance;
  P.block<3, 3>(nav::v, nav::v) = o.velocity_covariance;
  P.block<3, 3>(nav::bg, nav::bg) = o.gyro_bias_covariance;
  P.block<3, 3>(nav::ba, nav::ba) = o.accel_bias_covariance;
  return P;
}

}  // namespace

void PosePropagator::propagate_to(Time t) {
  const ImuSegment segment = readings_.between(newest_t_, t);
  if (segment.empty()) return;
  since_->integrate(segment);
  newest_t_ = t;
}

NavState<W> PosePropagator::newest_state() const {
  // Gravity is not along z while a correction of the tilt is still to be published.
  return since_->predict(estimated_state(), -gravity_mps2_ * estimate_->up_W);
}

/// Of the readings that are here, too.
void PosePropagator::correct_time_offset(Duration by) {
  const Duration now = given_offset_ + by;
  newest_t_ = newest_t_ + (time_offset_ - now);
  readings_.set_time_offset(now);
  time_offset_ = now;
}

std::optional<LivePose> PosePropagator::rebase(const Odometry& estimate) {
  const Time read_until = newest_t_;
  const bool same_world = estimate_ && estimate_->reset_counter == estimate.reset_counter;
  std::optional<NavState<W>> before;  // what was published so far for the same moment
  if (since_ && same_world && smoothing_s_ > 0 && estimate.health.has_pose()) {
    if (newest_t_ < estimate.t) propagate_to(estimate.t);
    before = newest_state().boxplus(offset_);
  }
  correct_time_offset(Duration::from_seconds(estimate.time_offset_s));
  readings_.forget_before(estimate.t - kMostCorrection);
  estimate_ = estimate;
  offset_.setZero();
  since_.reset();
  if (!estimate.health.has_pose()) return std::nullopt;
  const Time until = std::max(newest_t_, estimate.t);
  since_.emplace(noise_, estimate.bias);
  newest_t_ = estimate.t;
  propagate_to(until);
  if (read_until < estimate.t) return newest_pose(estimate.t, estimate.bias.gyro_radps);  // nothing better to be smooth with
  if (before) offset_.head<nav::bg>() = before->boxminus(newest_state()).head<nav::bg>();
  return std::nullopt;
}

std::optional<LivePose> PosePropagator::add(const ImuSample& reading) {
  if (!readings_.add(reading)) return std::nullopt;
  const Time t = reading.t - time_offset_;
  if (since_ && newest_t_ < t) {
    decay_offset((t - newest_t_).seconds());
    propagate_to(t);
    if (since_->dt_s() > kLongest_s) since_.reset();
  }
  if (!since_) newest_t_ = t;
  return newest_pose(t, readings_.newest().gyro_radps);
}

LivePose PosePropagator::newest_pose(Time t, const Vec3& gyro_radps) const {
  LivePose pose;
  pose.t = t;
  if (!estimate_) return pose;
  pose.estimate_t = estimate_->t;
  pose.health = estimate_->health;
  pose.reset_counter = estimate_->reset_counter;
  pose.tilt_sigma_rad = estimate_->tilt_sigma_rad;
  pose.level = estimate_->level;
  pose.scale_sigma = estimate_->scale_sigma;
  if (!since_) {
    if (pose.health.has_pose()) pose.health = {HealthState::lost, HealthReason::no_images};
    return pose;
  }
  const NavState<W> out = newest_state().boxplus(offset_);
  const Mat15 P = since_->predict_covariance(estimate_->T_WB.q, estimate_->bias, covariance_of(*estimate_));
  pose.T_WB = out.T_FB;
  pose.v_WB = out.v_FB;
  pose.w_WB_B = gyro_radps - out.bias.gyro_radps;
  pose.pose_covariance = P.topLeftCorner<6, 6>();
  pose.velocity_covariance = P.block<3, 3>(nav::v, nav::v);
  return pose;
}

void PosePropagator::decay_offset(double dt_s) {
  if (offset_.isZero(0)) return;
  offset_ *= std::exp(-dt_s / smoothing_s_);
  if (offset_.cwiseAbs().maxCoeff() < kNoOffset) offset_.setZero();
}

}  // namespace fbvins
