// SPDX-License-Identifier: Apache-2.0
// Private: files of an IMU beside a calibration of cameras: Kalibr's imu.yaml, whose cameras are given to imu0, with its place
// and clock, and the noise figures of imu_utils. Pure functions but for reading the file; any thread.
//
//   Result<StereoRig> rig = with_imu_file(*cameras, "imu.yaml");           // or "imu.yaml:imu1"
#pragma once

#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// The rig, whose cameras are given to Kalibr's body (imu0), with the noise of the IMU in the file and given to that IMU: T_i_b
/// takes coordinates of the body to those of the IMU, and time_offset is to be added to the IMU's stamps (as Kalibr does). An
/// error where the file has several IMUs in different places and the name does not end with ":imuN".
Result<StereoRig> with_imu_file(const StereoRig& rig, const std::string& name);
/// The same of a text. `which`: "imu1", or empty; `file` is only for messages.
Result<StereoRig> with_imu_text(const StereoRig& rig, const std::string& file, const std::string& text, const std::string& which);

}  // namespace fbvins
