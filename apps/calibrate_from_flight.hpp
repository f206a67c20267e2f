// SPDX-License-Identifier: Apache-2.0
// `fbvins calibrate --from-flight`: flies recordings with the calibration given, and refines it from what was seen.
#pragma once

#include <string>
#include <vector>

namespace fbvins::app {

struct FromFlightArguments {
  std::vector<std::string> runs;
  std::string calibration, imu_calibration, out;
  std::vector<std::string> topics;  ///< of bags
  bool quiet = false;
};

/// The command's exit code.
int calibrate_from_flight(const FromFlightArguments& arguments);

}  // namespace fbvins::app
