// SPDX-License-Identifier: Apache-2.0
// How far a published position may be off, at worst: what a mission compares with the room that it has.
//
//   if (protection_level_m(odometry.health, odometry.pose_covariance) > clearance_m) hold();
#pragma once

#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Standard deviation of a position along its worst direction, m; `pose_covariance` is of (position [m], attitude [rad]).
double worst_sigma_m(const Mat6& pose_covariance);

/// The probability that a pose's error is larger than its protection level.
enum class IntegrityRisk { once_in_1e4, once_in_1e6 };

/// Multiples of worst_sigma_m (docs/derivations/integrity.md, "Protection level").
inline constexpr double kProtectionOnceIn1e4 = 10, kProtectionOnceIn1e6 = 40;

/// Radius, m, that is meant to bound the error of a published position, relative to the start of W, with this probability of
/// exceeding it, if at most one sensor has failed. Measured where every flight has a fault: that of once in 10^4 is exceeded by
/// one pose in 10,250 of simulated tracks, and with images by none of 97,887 good ones; that of once in 10^6 continues this tail
/// (docs/experiments/integrity.md). Infinite where there is no pose, or no covariance.
double protection_level_m(const Health& health, const Mat6& pose_covariance, IntegrityRisk risk = IntegrityRisk::once_in_1e4);

}  // namespace fbvins
