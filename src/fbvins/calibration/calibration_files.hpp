// SPDX-License-Identifier: Apache-2.0
// A calibration as the files that other programs read. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/imu_camera.hpp"

namespace fbvins {

/// What all formats need of a rig.
struct RigCalibration {
  std::vector<Camera> cameras;  ///< with their own_times()
  std::vector<Pose<Cn, C0>> T_CnC0;
  std::vector<Pose<B, Cn>> T_BC;  ///< empty: without an IMU
  double time_offset_s = 0;       ///< t_imu = t_image + time_offset_s
  ImuNoise imu_noise;
  double line_delay_s = 0;  ///< of a rolling shutter, as in StereoRig
};

RigCalibration rig_calibration(const CameraCalibration& cameras);
/// Of an IMU whose axes were estimated these; else those of `noise`, by which the readings were corrected.
RigCalibration rig_calibration(const CameraCalibration& cameras, const CameraImuResult& imu, const ImuNoise& noise);

RigCalibration rig_calibration(const StereoRig& rig);

/// Kalibr's camchain.yaml; with an IMU its camchain-imucam.yaml. Numbers with 17 digits.
std::string to_kalibr_camchain(const RigCalibration& rig);
/// Kalibr's imu.yaml.
std::string to_kalibr_imu(const ImuNoise& noise);
/// Both in one file, the IMU under `imu0`: all that a rig is.
std::string to_kalibr_rig(const RigCalibration& rig);
/// Basalt's calibration.json, which has one time offset for all cameras, that of cam0, and no line delay; an error where a lens
/// model is none of its own. Without an IMU cam0 is the body.
Result<std::string> to_basalt(const RigCalibration& rig);
/// ROS CameraInfo of one camera, as camera_calibration writes it; an error for models that ROS does not know.
Result<std::string> to_ros_camera_info(const RigCalibration& rig, int camera);

}  // namespace fbvins
