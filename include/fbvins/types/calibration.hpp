// SPDX-License-Identifier: Apache-2.0
// Camera-IMU extrinsics and time offset as the estimator holds them: the rig's calibration, refined if that is switched on.
#pragma once

#include <vector>

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct Calibration {
  std::vector<Pose<B, C0>> cameras = {{}, {}};  ///< T_BC of each, two at least: the first two are refined
  double time_offset_s = 0;                     ///< t_imu = t_image + offset, beyond what the input has applied
  double line_delay_s = 0;                      ///< of a rolling shutter, beyond the calibrated one

  int camera_count() const { return static_cast<int>(cameras.size()); }
  const Pose<B, C0>& T_BC(int camera) const { return cameras[static_cast<std::size_t>(camera)]; }
  const Pose<B, C0>& T_BC0() const { return cameras[0]; }
  Pose<B, C1> T_BC1() const { return cameras[1].cast_frames<B, C1>(); }
};

}  // namespace fbvins
