// SPDX-License-Identifier: Apache-2.0
// Private: the rig from the calibration files of other programs, recognised by content. Any thread.
//
//   Result<StereoRig> rig = load_calibration("calibration.json");              // Basalt
//   Result<StereoRig> rig = load_calibration("camchain-imucam.yaml", "imu.yaml");
//
// Frames: B is the IMU, C0 the left and C1 the right camera, others follow; what the formats call T_cam_imu, T_imu_cam or
// body_T_cam0 is turned to T_BC0 and T_BC1. All cameras of a file are read, one at least.
#pragma once

#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// Kalibr's camchain-imucam.yaml; OpenVINS's estimator_config.yaml or kalibr_imucam_chain.yaml; Basalt's calibration.json;
/// VINS-Fusion's configuration with its two camera files; VINS-Mono's and ORB-SLAM3's configurations; an OAK's JSON; Kimera-VIO's
/// LeftCameraParams.yaml with the files beside it; an EuRoC folder with its sensor.yaml files. `imu_path`: noise figures as
/// Kalibr writes them, with the IMU's place (kalibr_imu.hpp), or imu_utils; without it they are the file's own, where it has any.
/// An error for a camera model that is not known.
Result<StereoRig> load_calibration(const std::string& path, const std::string& imu_path = "");

/// Two files of ROS's camera calibration (camera_info). They have the stereo extrinsics, but not those of the IMU: these are
/// T_BC0.
Result<StereoRig> load_camera_info(const std::string& left_path, const std::string& right_path, const Pose<B, C0>& T_BC0);

/// Which of them a file's text is: "Kalibr", "OpenVINS", "Basalt", "VINS-Fusion", "VINS-Mono", "ORB-SLAM3", "OAK", "Kimera",
/// "camera_info"; empty for none.
std::string calibration_format(const std::string& text);
bool is_kalibr(const std::string& path);
/// Whether it is a camera_info file of ROS, or several with commas between, a camera each.
bool is_camera_info(const std::string& paths);

}  // namespace fbvins
