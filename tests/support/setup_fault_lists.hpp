// SPDX-License-Identifier: Apache-2.0
// Faults of a setup by where they are made. Fresh ones at each call.
#pragma once

#include "fbvins/core/angle.hpp"
#include "tests/support/setup_faults.hpp"

namespace fbvins::setup_fault {

inline constexpr double kTenth = 0.1;  ///< tolerance of sizes
inline constexpr double kTimeTolerance_ms = 1, kRotationTolerance_deg = 0.5;
inline Mat3 turn(const Vec3& axis, double degrees) { return so3_exp(degrees / kDegreesPerRad * axis).toRotationMatrix(); }

std::vector<SetupFault> of_the_imu();
std::vector<SetupFault> of_gaps();
std::vector<SetupFault> of_the_calibration(const StereoRig& rig);
std::vector<SetupFault> of_the_images(const StereoRig& rig);

}  // namespace fbvins::setup_fault
