// SPDX-License-Identifier: Apache-2.0
// The accelerometer's bias by a vehicle that stands level: before any rotation a bias and a tilt look alike, and the floor tells
// them apart (docs/derivations/alignment.md, A22-A24). Pure function.
#pragma once

#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/imu_state.hpp"

namespace fbvins {

/// A vehicle that stands, level to a standard deviation that includes the IMU's mounting on it.
struct LevelStand {
  Vec3 up_B = Vec3::UnitZ();  ///< the vehicle's up in the IMU's frame, unit length
  double tilt_sigma_rad = 0;  ///< each of two axes
};

/// `prior` with what the floor says. `force_mps2`: mean reading of the accelerometer at rest, its bias included. The prior alone
/// where the two contradict each other: the vehicle is not level.
ImuBiasEstimate standing_bias(const ImuBiasEstimate& prior, const Vec3& force_mps2, const LevelStand& stand,
                              double gravity_mps2 = kGravity_mps2);

}  // namespace fbvins
