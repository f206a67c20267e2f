// SPDX-License-Identifier: Apache-2.0
// Private to calibration: from a recording to the least-squares problem and its start values, or the sentence why not. Pure
// functions.
#pragma once

#include "fbvins/calibration/imu_camera_path.hpp"

namespace fbvins {

struct CalibrationStart {
  Time reference;  ///< the path's start, IMU's clock
  CalibrationData data;
  CalibrationState state;
  CalibrationSetup setup;
  double nominal_gyro_sigma_radps = 0, nominal_accel_sigma_mps2 = 0;  ///< of a single reading, by the noise given
  Vec3 turning_radps = Vec3::Zero();                                  ///< spread of the turns along their principal axes
};

Result<CalibrationStart> collect_imu_camera(const ImuCameraInput& input, const ImuCameraOptions& options);

}  // namespace fbvins
