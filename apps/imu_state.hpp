// SPDX-License-Identifier: Apache-2.0
// `--imu-state FILE` of run and live: the IMU's biases are read when a flight begins and written when it has ended well.
#pragma once

#include <optional>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/types/imu_state.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins::app {

inline constexpr const char* kImuStateHelp =
    "biases of the IMU from flight to flight: read where the file is there, written at a clean end";

/// What a frame in good health knows of the IMU.
std::optional<ImuState> imu_state_of(const Odometry& odometry);

/// None without a path, and before the first flight.
Result<std::optional<ImuState>> load_imu_state(const std::string& path, const ImuNoise& imu);
/// Nothing is written where there is no path, or nothing was known; what an earlier flight has left stays then.
Result<void> save_imu_state(const std::string& path, const std::optional<ImuState>& state, const ImuNoise& imu);

}  // namespace fbvins::app
