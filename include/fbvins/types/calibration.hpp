// SPDX-License-Identifier: Apache-2.0
// Camera-IMU extrinsics and time offset as the estimator holds them: the rig's calibration, refined if that is switched on.
// Cameras from 2 on are not refined.
#pragma once

#include <vector>

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct Calibration {
  Pose<B, C0> T_BC0;
  Pose<B, C1> T_BC1;
  double time_offset_s = 0;            ///< t_imu = t_image + offset, beyond what the input has applied
  double line_delay_s = 0;             ///< of a rolling shutter, beyond the calibrated one
  std::vector<Pose<B, C0>> more = {};  ///< T_BC of cameras 2, 3 ...

  int camera_count() const { return 2 + static_cast<int>(more.size()); }
  Pose<B, C0> T_BC(int camera) const {
    if (camera < 2) return camera == 0 ? T_BC0 : T_BC1.cast_frames<B, C0>();
    return more[static_cast<std::size_t>(camera - 2)];
  }
};

}  // namespace fbvins
