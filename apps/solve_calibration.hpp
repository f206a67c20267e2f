// SPDX-License-Identifier: Apache-2.0
// From views of a board, and readings, to the calibration of cameras and IMU: all steps of `fbvins calibrate` after the search
// for the board. Pure function.
#pragma once

#include "apps/calibration_report.hpp"
#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/detections_file.hpp"

namespace fbvins::app {

struct CalibrationMaterial {
  Detections detections;
  std::vector<ImuSample> imu;  ///< none: the cameras alone
  std::optional<ImuNoise> imu_noise;
  std::vector<std::string> remarks;
};

/// An error where the material does not determine what is asked for.
Result<CalibrationOutcome> solve_calibration(const Board& board, const CalibrationMaterial& material,
                                             const CameraCalibrationOptions& cameras, const ImuCameraOptions& imu);

}  // namespace fbvins::app
