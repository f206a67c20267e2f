// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "apps/open_recording.hpp"

namespace fbvins::app {

void RecordingArguments::add_to(CLI::App& command) {
  command.add_option("DATASET", path, "EuRoC folder or zip, flight record, ROS bag, MCAP file, or TUM-VI folder")->required();
  command.add_option("--calibration", calibration,
                     "instead of the recording's own: of Kalibr, OpenVINS, Basalt or VINS-Fusion, or an EuRoC folder");
  command.add_option("--imu-calibration", imu_calibration, "Kalibr imu.yaml, with --calibration");
  command.add_option("--topics", topics, "of a bag, where they are not found: LEFT,RIGHT[,IMU]")->delimiter(',')->expected(2, 3);
}

}  // namespace fbvins::app
