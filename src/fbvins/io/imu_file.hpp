// SPDX-License-Identifier: Apache-2.0
// An IMU recording on its own: EuRoC's imu0/data.csv. Pure but for the file.
//
//   Result<std::vector<ImuSample>> imu = read_imu_csv("MH_01_easy/mav0/imu0/data.csv");
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Strictly increasing stamps; unusable rows are left out.
Result<std::vector<ImuSample>> read_imu_csv(const std::string& path);
/// The same, as it reads it again, to the bit.
std::string imu_to_csv(const std::vector<ImuSample>& readings);

}  // namespace fbvins
