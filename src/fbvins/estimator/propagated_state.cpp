// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/propagated_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fbvins/estimator/integrity_thresholds.hpp"
#include "fbvins/estimator/window_views.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

double sigma(const Mat3& covariance) { return std::sqrt(covariance.trace()); }

Vec3 up_B(const SlidingWindow& window) { return window.newest().state.T_FB.q.conjugate() * (window.tilt().q() * Vec3::UnitZ()); }

}  // namespace

void PropagatedState::carry(Time t, const ImuSegment& readings) {
  step_s_ = (t - now_).seconds();
  now_ = t;
  up_.carry(t, readings);
  velocity_.carry(readings);
}

void PropagatedState::compare(const SlidingWindow& window, const Solved& solved) {
  const NavState<G>& newest = window.newest().state;
  if (disputed_ || (unproven_s_ > 0 && solved.contradicted)) unproven_s_ = kProven_s;
  else unproven_s_ = std::max(0.0, unproven_s_ - step_s_);
  disputed_ = false;
  const bool doubted = solved.contradicted || solved.bias_suspected;
  if (doubted && !doubted_before_) up_.hold();
  doubted_before_ = doubted;
  tilt_away_ = up_.difference(up_B(window), newest.bias.gyro_radps);
  if (solved.clipped) velocity_.forget();
  const Odometry& odometry = solved.odometry;
  if (odometry.velocity_covariance.isZero(0)) return;
  velocity_.compare({newest, solved.gravity_G, sigma(odometry.velocity_covariance), solved.up_sigma_rad,
                     sigma(odometry.gyro_bias_covariance), sigma(odometry.accel_bias_covariance)},
                    tracks_in_view(window), solved.contradicted);
}

void PropagatedState::remember(const SlidingWindow& window, const Odometry& published, bool clipped) {
  if (clipped) up_.forget();
  if (published.health.state != HealthState::good) return;
  up_.take(
      {up_B(window), published.tilt_sigma_rad, window.newest().state.bias.gyro_radps, sigma(published.gyro_bias_covariance)});
}

void PropagatedState::restart(bool disputed) {
  disputed_ = disputed || unproven_s_ > 0;
  up_.restart();
  velocity_.restart();
}

void PropagatedState::begin_window() {
  tilt_away_.reset();
  doubted_before_ = false;
  unproven_s_ = 0;
  covariances_.reset();
}

void PropagatedState::fill_covariances(Odometry& out) {
  if (!out.pose_covariance.isZero(0)) {
    covariances_ = {out.t, out.pose_covariance, out.velocity_covariance, out.gyro_bias_covariance, out.accel_bias_covariance};
    return;
  }
  const Mat3 unknown = Mat3::Constant(std::numeric_limits<double>::quiet_NaN());
  const Covariances last = covariances_.value_or(Covariances{out.t, unknown.replicate<2, 2>(), unknown, unknown, unknown});
  const double dt = (out.t - last.t).seconds();
  out.pose_covariance = last.pose;
  out.pose_covariance.topLeftCorner<3, 3>() += dt * dt * last.velocity;
  out.velocity_covariance = last.velocity;
  out.gyro_bias_covariance = last.gyro_bias;
  out.accel_bias_covariance = last.accel_bias;
}

void PropagatedState::add_doubt(Odometry& out) const {
  if (tilt_away_) out.pose_covariance.bottomRightCorner<3, 3>() += tilt_away_->turn_B * tilt_away_->turn_B.transpose();
  const Vec3 &shift_G = velocity_.shift_G(), &velocity_G = velocity_.velocity_G();
  out.pose_covariance.topLeftCorner<3, 3>() += shift_G * shift_G.transpose();
  out.velocity_covariance += velocity_G * velocity_G.transpose();
}

}  // namespace fbvins
