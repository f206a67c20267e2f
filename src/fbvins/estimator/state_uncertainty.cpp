// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/state_uncertainty.hpp"

#include <cmath>

#include "fbvins/estimator/calibration_uncertainty.hpp"
#include "fbvins/estimator/mono_start.hpp"
#include "fbvins/estimator/window_views.hpp"

namespace fbvins {
namespace {

/// The slowest motion of one camera that shows the scale.
constexpr double kShowsScale_mps = 0.2;

}  // namespace

void StateUncertainty::fill(const Mat17& covariance, const NavState<G>& newest, const Tilt& tilt, const Vec3& mean_rate_B,
                            Odometry& out) {
  const Mat15 level = tilt.levelled_covariance(newest, covariance);
  out.pose_covariance = level.topLeftCorner<6, 6>();
  out.velocity_covariance = level.block<3, 3>(nav::v, nav::v);
  const NavState<W> level_state = tilt.levelled(newest);
  add_scale(level_state.T_FB.p - tilt.pivot, calibrated_scale_sigma_, out.pose_covariance.topLeftCorner<3, 3>());
  add_scale(level_state.v_FB, calibrated_scale_sigma_, out.velocity_covariance);
  out.gyro_bias_covariance = level.block<3, 3>(nav::bg, nav::bg) + axis_covariance(mean_rate_B.norm());
  out.accel_bias_covariance = level.block<3, 3>(nav::ba, nav::ba) + axis_covariance(gravity_mps2_);
  velocity_sigma_mps_ = std::sqrt(out.velocity_covariance.trace() / 3);
  up_sigma_rad_ = fbvins::up_sigma_rad(covariance);
  if (one_camera_ && level_state.v_FB.norm() > kShowsScale_mps)
    scale_sigma_ = scale_sigma_of(level_state.v_FB, out.velocity_covariance);
  out.scale_sigma = scale_sigma_;
}

}  // namespace fbvins
