// SPDX-License-Identifier: Apache-2.0
// Noise figures of a calibration that no IMU of this kind has: a wrong unit, a digit too many. Readings in flight do not tell
// them from vibration, so they are judged by what sensors there are. Pure functions, any thread.
//
//   if (auto finding = check_noise_figures(rig.imu_noise)) report(*finding);
#pragma once

#include <optional>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

std::optional<Finding> check_noise_figures(const ImuNoise& noise);

/// With the default in place of each density that is not plausible.
ImuNoise plausible(ImuNoise noise);

}  // namespace fbvins
