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
/// without moving the body, while a hand-held body moves slowly and far.
struct RestOptions {
  double min_window_s = 0.4;  ///< shortest window of readings that can prove rest
  double block_s = 0.1;
  double max_gyro_spread_radps = 0.015;  ///< standard deviation of the block means, as that below
  double max_accel_spread_mps2 = 0.2;
  double noise_factor = 6;             ///< or this many sigmas of the sensor's own noise, if that is more
  double max_image_motion_px = 1.0;    ///< median over the features, for the whole window
  double max_gyro_mean_radps = 0.2;    ///< a larger mean is a turn and not a bias
  double max_accel_error_mps2 = 0.8;   ///< of the mean's norm against gravity
  double max_gap_s = 0.05;             ///< longest in the readings
  double accel_bias_sigma_mps2 = 0.1;  ///< prior; it makes roll and pitch uncertain
  double position_sigma_m = 1e-3;      ///< of the prior that fixes the frame
  double yaw_sigma_rad = 1e-3;         ///< likewise
  double velocity_sigma_mps = 0.02;    ///< of the velocity at rest
};

enum class RestRefusal { none, too_short, imu_gap, image_moves, gyro_spread, accel_spread, gyro_mean, accel_mean };

std::string_view to_string(RestRefusal reason);

struct RestEstimate {
  bool at_rest = false;
  RestRefusal reason = RestRefusal::none;
  /// In a new gauge: origin at the body, up along the mean specific force, no rotation about gravity (level_rotation),
  /// velocity and accelerometer bias zero.
  NavState<G> state;
  /// Of the state in (p, theta, v, bg, ba); tilt and accelerometer bias are correlated (eq. A4).
  Mat15 covariance = Mat15::Zero();
  double gyro_spread_radps = 0;
  double accel_spread_mps2 = 0;
};

/// The shortest rotation R_GB that takes up_B (any length) to +z of G: heading zero by definition.
Quat level_rotation(const Vec3& up_B);

RestEstimate initialise_at_rest(const std::vector<ImuSample>& window, double image_motion_px, const ImuNoise& noise,
                                const RestOptions& options = {}, double gravity_mps2 = kGravity_mps2);

}  // namespace fbvins
