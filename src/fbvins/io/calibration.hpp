// SPDX-License-Identifier: Apache-2.0
// The text of calibration files to values, checked. Pure functions, any thread.
//
// Frames: EuRoC's T_BS takes sensor to body coordinates; Kalibr's T_cam_imu takes IMU to camera
// coordinates and is inverted here. Our B is the IMU.
#pragma once

#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// One camera's EuRoC sensor.yaml; S is that sensor, B the file's body frame.
struct CameraSensor {
  Camera camera;
  Pose<B, C0> T_BS;
  double rate_hz = 20;
};

/// EuRoC imu0/sensor.yaml.
struct ImuSensor {
  ImuNoise noise;
  Pose<B, B> T_BS;  ///< takes IMU to the file's body coordinates; the identity in EuRoC
};

/// `file` is only for messages.
Result<CameraSensor> parse_euroc_camera(const std::string& text, const std::string& file);
Result<ImuSensor> parse_euroc_imu(const std::string& text, const std::string& file);
/// Only the T_BS of a sensor.yaml.
Result<Pose<B, B>> parse_euroc_mounting(const std::string& text, const std::string& file);
/// Joins the three; an error where the two cameras are at the same place.
Result<StereoRig> join_euroc(const CameraSensor& left, const CameraSensor& right, const ImuSensor& imu, const std::string& file);

/// Kalibr's camchain-imucam text; imu_noise stays at its defaults.
Result<StereoRig> parse_kalibr_camchain(const std::string& text, const std::string& file);
/// Kalibr's imu.yaml, with or without the `imu0:` level.
Result<ImuNoise> parse_kalibr_imu(const std::string& text, const std::string& file);

}  // namespace fbvins
