// SPDX-License-Identifier: Apache-2.0
// Decides from a window of readings whether the body is at rest, and if so gives roll, pitch and gyro bias
// (docs/derivations/alignment.md, eq. A1-A3).
//
//   RestEstimate rest = initialise_at_rest(segment.samples, noise, options);
//   if (rest.at_rest) start(rest.state);
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
  double noise_factor = 6;            ///< or this many sigmas of the sensor's own noise, if that is more
  double max_gyro_mean_radps = 0.2;   ///< a larger mean is a turn and not a bias
  double max_accel_error_mps2 = 0.8;  ///< of the mean's norm against gravity
  double max_gap_s = 0.05;            ///< longest in the readings
};

enum class RestRefusal { none, too_short, imu_gap, gyro_spread, accel_spread, gyro_mean, accel_mean };

std::string_view to_string(RestRefusal reason);

struct RestEstimate {
  bool at_rest = false;
  RestRefusal reason = RestRefusal::none;
  /// In a new gauge: origin at the body, up along the mean specific force, no rotation about gravity (level_rotation),
  /// velocity and accelerometer bias zero.
  NavState<G> state;
  Vec3 force_mps2 = Vec3::Zero();  ///< mean of the readings
  double gyro_spread_radps = 0;
  double accel_spread_mps2 = 0;
};

/// The shortest rotation R_GB that takes up_B (any length) to +z of G: heading zero by definition.
Quat level_rotation(const Vec3& up_B);

RestEstimate initialise_at_rest(const std::vector<ImuSample>& window, const ImuNoise& noise, const RestOptions& options = {},
                                double gravity_mps2 = kGravity_mps2);

}  // namespace fbvins
