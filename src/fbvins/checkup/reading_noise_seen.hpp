// SPDX-License-Identifier: Apache-2.0
// The white noise that readings show, against what the calibration declares. Motion and vibration add to it, so that a figure
// that is too large is seen anywhere, one that is too small only at rest. Pure functions, any thread.
//
//   if (const auto seen = reading_noise_seen(samples)) compare(seen->quietest, declared);
#pragma once

#include <optional>
#include <span>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

struct Densities {
  double gyro_radps_rthz = 0, accel_mps2_rthz = 0;
};

struct ReadingNoiseSeen {
  Densities quietest;                     ///< of the quietest half second, vibration included
  std::optional<Densities> at_rest = {};  ///< of the time at rest, if there is enough of it
};

/// None for less than three seconds of readings.
std::optional<ReadingNoiseSeen> reading_noise_seen(std::span<const ImuSample> samples);

/// The unit of such a finding.
inline constexpr const char* kOfReadings = "times what the readings show";

/// Densities that are declared and cannot be those of these readings; with the figures to write in `write`.
std::optional<Finding> check_declared_noise(std::span<const ImuSample> samples, const ImuNoise& declared, ImuNoise& write);

}  // namespace fbvins
