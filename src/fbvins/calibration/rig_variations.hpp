// SPDX-License-Identifier: Apache-2.0
// What lenses and extrinsics of calibrated cameras are uncertain by, as rigs that differ a little: a factor of their covariance,
// so that what is computed with the rig inherits its uncertainty. Pure functions, any thread.
//
//   input.variations = rig_variations(cameras);      // of calibrate_cameras(), for calibrate_imu_camera()
#pragma once

#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"

namespace fbvins {

/// The rig after a step of `sigmas` standard deviations in one of its independent directions.
struct RigVariation {
  std::vector<Camera> cameras;
  std::vector<Pose<Cn, C0>> T_CnC0;
  double sigmas = 0.02;  ///< small: far steps of some lenses' parameters are not linear
};

std::vector<RigVariation> rig_variations(const CameraCalibration& cameras);

}  // namespace fbvins
