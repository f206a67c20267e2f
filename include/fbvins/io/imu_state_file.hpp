// SPDX-License-Identifier: Apache-2.0
// An IMU's biases and time offset from flight to flight, as YAML with every number exact. Any thread, different files.
//
//   Result<std::optional<ImuState>> state = read_imu_state("imu_state.yaml", rig.imu_noise);   // none: no such file yet
//   Result<void> kept = write_imu_state("imu_state.yaml", end_of_flight, rig.imu_noise);
#pragma once

#include <optional>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/types/imu_state.hpp"

namespace fbvins {

/// `imu` is the IMU in use: a file with other noise figures belongs to another IMU and is an error, as is an incomplete one.
/// `file` is only for messages.
Result<ImuState> parse_imu_state(const std::string& text, const std::string& file, const ImuNoise& imu);
/// None where there is no such file.
Result<std::optional<ImuState>> read_imu_state(const std::string& path, const ImuNoise& imu);
std::string imu_state_to_yaml(const ImuState& state, const ImuNoise& imu);
/// The file appears whole or not at all.
Result<void> write_imu_state(const std::string& path, const ImuState& state, const ImuNoise& imu);

}  // namespace fbvins
