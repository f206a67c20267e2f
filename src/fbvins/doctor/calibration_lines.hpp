// SPDX-License-Identifier: Apache-2.0
// Lines of a calibration file with other numbers, as EuRoC and Kalibr write them. Pure functions.
#pragma once

#include <string>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

enum class CalibrationStyle { euroc, kalibr };

/// Where a camera sits, of both cameras: T_BS in cam0 and cam1's sensor.yaml, or T_cam_imu.
std::string mounting_lines(const StereoRig& rig, CalibrationStyle style, bool both);
/// Focal lengths and principal point.
std::string intrinsics_line(const Camera& camera, bool left, CalibrationStyle style);
std::string distortion_line(const Camera& camera, bool left, CalibrationStyle style);
std::string time_line(double offset_s, CalibrationStyle style);

}  // namespace fbvins
