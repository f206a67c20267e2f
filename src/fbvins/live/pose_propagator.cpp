// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/pose_propagator.hpp"

#include <cmath>

#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

/// Readings kept while no estimate comes; a pose propagated for longer is of no use.
constexpr std::size_t kMaxReadings = 20000;
/// A smaller offset is set to zero; m, rad and m/s.
constexpr double kNoOffset = 1e-7;

ImuSample interpolate(const ImuSample& a, const ImuSample& b, Time t) {
  const double s = (t - a.t).seconds() / (b.t - a.t).seconds();
  return {t, (1 - s) * a.gyro_radps + s * b.gyro_radps, (1 - s) * a.accel_mps2 + s * b.accel_mps2};
}

Mat15 initial_covariance(const Odometry& o) {
  Mat15 P = Mat15::Zero();
  P.block<6, 6>(nav::p, nav::p) = o.pose_covariance;
  P.block<3, 3>(nav::v, nav::v) = o.velocity_covariance;
  P.block<3, 3>(nav::bg, nav::bg) = o.gyro_bias_covariance;
  P.block<3, 3>(nav::ba, nav::ba) = o.accel_bias_covariance;
  return P;
}

/// d(state after)/d(state before) over a short step, to first order (docs/derivations/preintegration.md).
Mat15 transition(const NavState& s, const ImuSample& reading, double dt) {
  const Mat3 R = s.T_WB.q.toRotationMatrix();
  const Mat3 Ra = R * hat(reading.accel_mps2 - s.bias.accel_mps2);
  Mat15 F = Mat15::Identity();
  F.block<3, 3>(nav::p, nav::theta) = -0.5 * dt * dt * Ra;
  F.block<3, 3>(nav::p, nav::v) = dt * Mat3::Identity();
  F.block<3, 3>(nav::p, nav::ba) = -0.5 * dt * dt * R;
  F.block<3, 3>(nav::theta, nav::theta) = so3_exp(-dt * (reading.gyro_radps - s.bias.gyro_radps)).toRotationMatrix();
  F.block<3, 3>(nav::theta, nav::bg) = -dt * Mat3::Identity();
  F.block<3, 3>(nav::v, nav::theta) = -dt * Ra;
  F.block<3, 3>(nav::v, nav::ba) = -dt * R;
  return F;
}

}  // namespace

void PosePropagator::advance(Propagated& p, const ImuSample& from, const ImuSample& to) const {
  const Vec3 gravity_W = -gravity_mps2_ * estimate_->up_W;  // not along z while a correction of the tilt is still to be published
  const double dt = (to.t - from.t).seconds();
  if (dt <= 0) return;
  const auto square = [](double x) { return x * x; };
  const Mat15 F = transition(p.state, from, dt);
  p.P = F * p.P * F.transpose();
  p.P.diagonal().segment<3>(nav::theta).array() += dt * square(noise_.gyro_noise_density_radps_rthz);
  p.P.diagonal().segment<3>(nav::v).array() += dt * square(noise_.accel_noise_density_mps2_rthz);
  p.P.diagonal().segment<3>(nav::bg).array() += dt * square(noise_.gyro_random_walk_radps2_rthz);
  p.P.diagonal().segment<3>(nav::ba).array() += dt * square(noise_.accel_random_walk_mps3_rthz);
  p.state = propagate(p.state, {{from, to}, {}}, gravity_W);
  p.t = to.t;
}

PosePropagator::Propagated PosePropagator::propagate_all() const {
  const Time start = estimate_->t + time_offset_;
  Propagated p{start, {estimate_->T_WB, estimate_->v_WB, estimate_->bias}, initial_covariance(*estimate_)};
  if (!readings_.empty() && readings_.front().t > start) {  // no reading before: the first one is held
    ImuSample held = readings_.front();
    held.t = start;
    advance(p, held, readings_.front());
  }
  for (std::size_t k = 1; k < readings_.size(); ++k) {
    const ImuSample &from = readings_[k - 1], &to = readings_[k];
    if (to.t <= start) continue;
    advance(p, from.t < start ? interpolate(from, to, start) : from, to);
  }
  return p;
}

/// Between the newest reading and the `next` one, at or before which `t` is; without a reading, the next one is held.
ImuSample PosePropagator::reading_at(Time t, const ImuSample& next) const {
  if (!readings_.empty()) return readings_.back().t < t ? interpolate(readings_.back(), next, t) : readings_.back();
  ImuSample held = next;
  held.t = t;
  return held;
}

void PosePropagator::rebase(const Odometry& estimate) {
  const Time start = estimate.t + time_offset_;
  if (newest_ && newest_->t < start && !readings_.empty()) {  // no reading as new as the estimate: the last one is held
    ImuSample from = readings_.back(), to = readings_.back();
    from.t = newest_->t, to.t = start;
    advance(*newest_, from, to);  // for the comparison below
  }
  while (readings_.size() > 1 && readings_[1].t <= start) readings_.pop_front();
  const bool same_world = estimate_ && estimate_->reset_counter == estimate.reset_counter;
  estimate_ = estimate;
  if (!estimate.health.has_pose()) {
    newest_.reset();
    offset_.setZero();
    return;
  }
  const Propagated now = propagate_all();
  if (newest_ && same_world && smoothing_s_ > 0)
    offset_.head<nav::bg>() = newest_->state.boxplus(offset_).boxminus(now.state).head<nav::bg>();
  else offset_.setZero();
  newest_ = now;
}

LivePose PosePropagator::add(const ImuSample& reading) {
  if (newest_ && newest_->t < reading.t) {
    decay_offset((reading.t - newest_->t).seconds());
    advance(*newest_, reading_at(newest_->t, reading), reading);
  }
  readings_.push_back(reading);
  if (readings_.size() > kMaxReadings) readings_.pop_front();

  LivePose pose;
  pose.t = reading.t;
  if (!estimate_) return pose;
  pose.estimate_t = estimate_->t;
  pose.health = estimate_->health;
  pose.reset_counter = estimate_->reset_counter;
  pose.tilt_sigma_rad = estimate_->tilt_sigma_rad;
  pose.level = estimate_->level;
  if (!newest_) return pose;
  const NavState out = newest_->state.boxplus(offset_);
  pose.T_WB = out.T_WB;
  pose.v_WB = out.v_WB;
  pose.w_WB_B = reading.gyro_radps - out.bias.gyro_radps;
  pose.pose_covariance = newest_->P.topLeftCorner<6, 6>();
  pose.velocity_covariance = newest_->P.block<3, 3>(nav::v, nav::v);
  return pose;
}

void PosePropagator::decay_offset(double dt_s) {
  if (offset_.isZero(0)) return;
  offset_ *= std::exp(-dt_s / smoothing_s_);
  if (offset_.cwiseAbs().maxCoeff() < kNoOffset) offset_.setZero();
}

}  // namespace fbvins
