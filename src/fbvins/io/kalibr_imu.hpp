// SPDX-License-Identifier: Apache-2.0
// Private: files of an IMU beside a calibration of cameras: Kalibr's imu.yaml, whose cameras are given to imu0, with its place
// and clock, and the noise figures of imu_utils. Pure functions but for reading the file; any thread.
//
//   Result<StereoRig> rig = with_imu_file(*cameras, "imu.yaml");           // or "imu.yaml:imu1"
#pragma once

#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// The rig, whose cameras are given to Kalibr's body (imu0), with the noise of the IMU in the file and given to that IMU: T_i_b
/// takes coordinates of the body to those of the IMU, and time_offset is to be added to the IMU's stamps (as Kalibr does). An
/// error where the file has several IMUs in different places and the name does not end with ":imuN".
Result<StereoRig> with_imu_file(const StereoRig& rig, const std::string& name);
/// The same of a text. `which`: "imu1", or empty; `file` is only for messages.
Result<StereoRig> with_imu_text(const StereoRig& rig, const std::string& file, const std::string& text, const std::string& which);

/// The topics of imu0, imu1 ... of a file of several; empty of one, and where it cannot be read.
std::vector<std::string> topics_of_imus(const std::string& path);
/// The name with ":imuN" behind it where the topic of one of the file's IMUs alone is among those recorded; else as it is.
std::string imu_of_topics(const std::string& path, const std::vector<std::string>& recorded);

}  // namespace fbvins
