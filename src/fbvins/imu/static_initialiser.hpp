// SPDX-License-Identifier: Apache-2.0
// Decides from a window of readings (and the motion of the image) whether the body is at rest, and if
// so gives roll, pitch and gyro bias (docs/derivations/alignment.md, eq. A1-A5).
//
//   RestEstimate rest = initialise_at_rest(segment.samples, image_motion_px, noise, options);
//   if (rest.at_rest) start(rest.state, rest.covariance);
//
// Threads: pure function.
#pragma once

#include <string_view>
#include <vector>

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Spread is measured on means over blocks of block_s: an idling rotor shakes the readings by 1 m/s^2
/// and yet goes nowhere, while a hand that holds the camera moves slowly and far.
struct RestOptions {
  double min_window_s = 0.4;
  double block_s = 0.1;
  double max_gyro_spread_radps = 0.015;
  double max_accel_spread_mps2 = 0.2;
  double noise_factor = 6;            ///< or this many sigmas of the sensor's own noise, if that is more
  double max_image_motion_px = 1.0;   ///< median over the features, for the whole window
  double max_gyro_mean_radps = 0.2;   ///< a larger mean is a turn and not a bias
  double max_accel_error_mps2 = 0.8;  ///< of the mean's norm against gravity
  double max_gap_s = 0.05;
  double accel_bias_sigma_mps2 = 0.1;  ///< prior; it makes roll and pitch uncertain
  double position_sigma_m = 1e-3;      ///< of the prior that fixes the frame
  double yaw_sigma_rad = 1e-3;         ///< likewise
  double velocity_sigma_mps = 0.02;

  template <class V>
  void visit(V&& v) {
    v("min_window_s", min_window_s, "s", "shortest window of readings that can prove rest", 0.1, 10.0);
    v("block_s", block_s, "s", "readings are averaged over blocks this long", 0.01, 1.0);
    v("max_gyro_spread_radps", max_gyro_spread_radps, "rad/s", "standard deviation of block means at rest", 1e-4, 0.5);
    v("max_accel_spread_mps2", max_accel_spread_mps2, "m/s^2", "standard deviation of block means at rest", 1e-3, 5.0);
    v("noise_factor", noise_factor, "", "or as many sigmas of the sensor's noise", 1.0, 50.0);
    v("max_image_motion_px", max_image_motion_px, "px", "median feature motion over the window at rest", 0.05, 20.0);
    v("max_gyro_mean_radps", max_gyro_mean_radps, "rad/s", "largest gyro bias", 0.001, 1.0);
    v("max_accel_error_mps2", max_accel_error_mps2, "m/s^2", "largest error of the mean specific force", 0.01, 3.0);
    v("max_gap_s", max_gap_s, "s", "longest gap in the readings", 0.005, 1.0);
    v("accel_bias_sigma_mps2", accel_bias_sigma_mps2, "m/s^2", "prior of the accelerometer bias", 1e-4, 2.0);
    v("position_sigma_m", position_sigma_m, "m", "prior that fixes the origin", 1e-9, 1.0);
    v("yaw_sigma_rad", yaw_sigma_rad, "rad", "prior that fixes the heading", 1e-9, 1.0);
    v("velocity_sigma_mps", velocity_sigma_mps, "m/s", "velocity left at rest", 1e-6, 1.0);
  }
};

enum class RestRefusal { none, too_short, imu_gap, image_moves, gyro_spread, accel_spread, gyro_mean, accel_mean };

std::string_view to_string(RestRefusal reason);

struct RestEstimate {
  bool at_rest = false;
  RestRefusal reason = RestRefusal::none;
  /// Origin at the body, up along the mean specific force, no rotation about gravity (level_rotation),
  /// velocity and accelerometer bias zero.
  NavState state;
  /// Of the state in (p, theta, v, bg, ba); tilt and accelerometer bias are correlated (eq. A4).
  Mat15 covariance = Mat15::Zero();
  double gyro_spread_radps = 0;
  double accel_spread_mps2 = 0;
};

/// The shortest rotation R_WB that takes up_B (any length) to +z of W: heading zero by definition.
Quat level_rotation(const Vec3& up_B);

RestEstimate initialise_at_rest(const std::vector<ImuSample>& window, double image_motion_px, const ImuNoise& noise,
                                const RestOptions& options = {}, double gravity_mps2 = kGravity_mps2);

}  // namespace fbvins
