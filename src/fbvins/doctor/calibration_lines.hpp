// SPDX-License-Identifier: Apache-2.0
// Corrected lines of a calibration file, in EuRoC's or Kalibr's format. Pure functions.
#pragma once

#include <string>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

enum class CalibrationStyle { euroc, kalibr };

/// Extrinsics of the right or of both cameras: T_BS in cam0's and cam1's sensor.yaml, or T_cam_imu.
std::string mounting_lines(const StereoRig& rig, CalibrationStyle style, bool both);
/// Focal lengths and principal point.
std::string intrinsics_line(const Camera& camera, bool left, CalibrationStyle style);
std::string distortion_line(const Camera& camera, bool left, CalibrationStyle style);
/// The mask that the doctor writes.
std::string mask_line(bool left, CalibrationStyle style);
std::string time_line(double offset_s, CalibrationStyle style);

}  // namespace fbvins
