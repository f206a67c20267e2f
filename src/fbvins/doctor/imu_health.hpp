// SPDX-License-Identifier: Apache-2.0
// Readings that reached the end of their range, and shaking that an IMU cannot follow. Pure functions, any thread.
#pragma once

#include <optional>
#include <span>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

std::optional<Finding> check_saturation(std::span<const ImuSample> samples);
/// Readings of the gyroscope's axes that stand at the end of their range, over the number of readings.
double cut_off_share_of_gyro(std::span<const ImuSample> samples);

struct Vibration {
  double rms_mps2 = 0;    ///< of what is faster than kVibrationFrom_hz, all axes
  double peak_hz = 0;     ///< where its spectrum is strongest
  double peak_share = 0;  ///< of its power within 5 % of that
};
inline constexpr double kVibrationFrom_hz = 30;

/// Zeros for fewer than a second of readings, or slower ones than 80 Hz.
Vibration measure_vibration(std::span<const ImuSample> samples);
std::optional<Finding> check_vibration(std::span<const ImuSample> samples);

}  // namespace fbvins
