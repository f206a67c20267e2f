// SPDX-License-Identifier: Apache-2.0
// Units of an IMU from its readings alone. Pure functions, any thread.
//
//   for (Finding& finding : check_reading_units(samples)) report(finding);
#pragma once

#include <span>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Gravity as the readings show it: median over half seconds of the norm of the mean specific force, m/s^2, with its standard
/// deviation. Zeros for less than two seconds of readings.
struct GravitySeen {
  double norm_mps2 = 0, sigma_mps2 = 0;
};
GravitySeen gravity_seen(std::span<const ImuSample> samples);

/// A gyroscope in degrees is recognised here only in fast rotation; the whole doctor recognises it by the cameras.
std::vector<Finding> check_reading_units(std::span<const ImuSample> samples);

}  // namespace fbvins
