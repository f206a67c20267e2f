// SPDX-License-Identifier: Apache-2.0
// `fbvins calibrate --imu-noise`: the noise of an IMU's readings, from a recording at rest.
#pragma once

#include <string>
#include <vector>

namespace fbvins::app {

struct ImuNoiseArguments {
  std::string recording, out;
  std::vector<std::string> topics;  ///< of bags
  bool quiet = false;
};

/// The command's exit code.
int measure_imu_noise(const ImuNoiseArguments& arguments);

}  // namespace fbvins::app
