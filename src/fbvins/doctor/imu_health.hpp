// SPDX-License-Identifier: Apache-2.0
// Saturated readings, and vibration that is too strong for an IMU. Pure functions, any thread.
#pragma once

#include <optional>
#include <span>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

std::optional<Finding> check_saturation(std::span<const ImuSample> samples);
/// Saturated readings of the gyroscope's axes over the number of readings.
double cut_off_share_of_gyro(std::span<const ImuSample> samples);

struct Vibration {
  double rms_mps2 = 0;    ///< above kVibrationFrom_hz, of all axes
  double peak_hz = 0;     ///< where its spectrum is strongest
  double peak_share = 0;  ///< of its power, within 5 % of peak_hz
};
inline constexpr double kVibrationFrom_hz = 30;

/// Zeros for fewer than 512 readings, or below 80 Hz.
Vibration measure_vibration(std::span<const ImuSample> samples);
std::optional<Finding> check_vibration(std::span<const ImuSample> samples);

}  // namespace fbvins
