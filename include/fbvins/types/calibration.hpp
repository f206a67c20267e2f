// SPDX-License-Identifier: Apache-2.0
// Camera-IMU extrinsics and time offset as the estimator holds them: the rig's calibration, refined if that is switched on.
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct Calibration {
  Pose<B, C0> T_BC0;
  Pose<B, C1> T_BC1;
  double time_offset_s = 0;  ///< t_imu = t_image + offset, beyond what the input has applied
};

}  // namespace fbvins
