// SPDX-License-Identifier: Apache-2.0
// Private: what of a calibration is possible and hardly true. Any thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// A sentence each: time offsets and line delays as of another unit, noise figures as of another unit, or of the other sensor.
std::vector<std::string> calibration_doubts(const StereoRig& rig);

/// Of a Kalibr chain: where a camera's T_cn_cnm1 or T_imu_cam contradicts T_cam_imu, which is used. Empty where the file cannot
/// be read.
std::vector<std::string> chain_doubts(const std::string& camchain_path);

}  // namespace fbvins
