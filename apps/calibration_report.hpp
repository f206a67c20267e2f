// SPDX-License-Identifier: Apache-2.0
// What `fbvins calibrate` prints and writes. Pure functions but for write_calibration().
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fbvins/calibration/calibration_files.hpp"
#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/calibration/weak_parts.hpp"
#include "fbvins/core/atomic_file.hpp"

namespace fbvins::app {

struct CalibrationOutcome {
  Board board;
  CameraCalibration cameras;
  std::optional<CameraImuResult> imu;
  ImuNoise imu_noise;
  std::vector<WeakPart> weak;
  std::vector<std::string> remarks;  ///< beside those of the two parts
};

/// Every parameter of the cameras with its deviation; rotations as rotation vectors.
std::vector<CalibratedParameter> camera_parameters(const CameraCalibration& cameras);

/// Of cameras, IMU and the command, in this order.
std::vector<std::string> all_remarks(const CalibrationOutcome& outcome);

/// For people: parameters with deviations, residuals, remarks.
std::string calibration_text(const CalibrationOutcome& outcome);
std::string calibration_summary_json(const CalibrationOutcome& outcome);

/// A rig in all formats: camchain.yaml or camchain-imucam.yaml and imu.yaml, calibration.json, camera_info_camN.yaml.
std::vector<NamedText> rig_files(const RigCalibration& rig);

/// camchain.yaml or camchain-imucam.yaml and imu.yaml, calibration.json, camera_info_camN.yaml, summary.json, calibration.txt,
/// calibration.html.
Result<void> write_calibration(const CalibrationOutcome& outcome, const std::string& folder);

}  // namespace fbvins::app
