// SPDX-License-Identifier: Apache-2.0
// Readings that a sensor cannot have measured, axis by axis: an axis that reads a constant while others move, and single readings
// far from those before and after them. Pure functions, any thread.
//
//   if (auto finding = check_stuck(samples, true)) ...           // of the gyroscope
//   const Spikes spikes = find_spikes(samples);
//   if (auto finding = check_spikes(spikes)) samples = without(spikes, samples);
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// An axis of the gyroscope, or of the accelerometer, or all of it.
std::optional<Finding> check_stuck(std::span<const ImuSample> samples, bool gyro);

struct Spikes {
  std::vector<std::size_t> at;                 ///< which readings, ascending
  int gyro = 0, accel = 0;                     ///< how many of each sensor
  double largest_radps = 0, largest_mps2 = 0;  ///< from the nearer neighbour
  double seconds = 0;                          ///< of readings
};

/// None where they are so few that they may be shocks.
Spikes find_spikes(std::span<const ImuSample> samples);
std::optional<Finding> check_spikes(const Spikes& spikes);
/// Both of both sensors, axes that are stuck first.
std::vector<Finding> check_readings(std::span<const ImuSample> samples);
/// The readings with both sensors interpolated where one has a spike.
std::vector<ImuSample> without(const Spikes& spikes, std::span<const ImuSample> samples);

}  // namespace fbvins
