// SPDX-License-Identifier: Apache-2.0
// `--imu-state FILE` of run and live: the IMU's biases and time offset are read when a flight begins and written at its regular
// end.
#pragma once

#include <optional>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/types/imu_state.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins::app {

inline constexpr const char* kImuStateHelp =
    "file that keeps the IMU's biases and time offset from flight to flight: read if it exists, written at a regular end";

/// The IMU's biases as of a frame in good health, and its time offset, that of the rig included; none in other states.
std::optional<ImuState> imu_state_of(const Odometry& odometry, double rig_time_offset_s);

/// None without a path, and before the first flight.
Result<std::optional<ImuState>> load_imu_state(const std::string& path, const ImuNoise& imu);
/// Nothing is written without a path or a state; the file of an earlier flight then stays.
Result<void> save_imu_state(const std::string& path, const std::optional<ImuState>& state, const ImuNoise& imu);

}  // namespace fbvins::app
