// SPDX-License-Identifier: Apache-2.0
// Calibration files to values, checked. Pure functions, but for pictures of masks, which `read` gets; each file is parsed once,
// however many parts of it are read.
//
// Frames: EuRoC's T_BS takes sensor to body coordinates; Kalibr's T_cam_imu takes IMU to camera
// coordinates and is inverted here. Our B is the IMU.
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/mask_fields.hpp"

namespace fbvins {

/// One camera's EuRoC sensor.yaml; S is that sensor, B the file's body frame.
struct CameraSensor {
  Camera camera;
  Pose<B, C0> T_BS;
  double rate_hz = 20;
  /// timeshift_cam_imu, Kalibr's name: EuRoC has none, recordings of `fbvins convert` do. Without it that of the first camera.
  std::optional<double> time_offset_s;
  double line_delay_s = 0;  ///< line_delay_us of a rolling shutter
};

/// EuRoC imu0/sensor.yaml.
struct ImuSensor {
  ImuNoise noise;
  Pose<B, B> T_BS;  ///< takes IMU to the file's body coordinates; the identity in EuRoC
};

Result<CameraSensor> parse_euroc_camera(YamlReader yaml, const ReadBeside& read = {});
Result<ImuSensor> parse_euroc_imu(YamlReader yaml);
/// depth0/sensor.yaml of a depth sensor: registered to cam0, or with a lens and a pose of its own (docs/rigs.md). `T_BI`: the
/// IMU's, ImuSensor::T_BS.
Result<DepthSensor> parse_depth_sensor(YamlReader yaml, const Pose<B, B>& T_BI);
/// Only the T_BS of a sensor.yaml.
Result<Pose<B, B>> parse_euroc_mounting(YamlReader yaml);
/// The rig of these cameras, one or more, and the IMU; `file` is only for messages. An error where check_rig has one.
Result<StereoRig> join_euroc(const std::vector<CameraSensor>& cameras, const ImuSensor& imu, const std::string& file);

/// Kalibr's camchain-imucam.yaml; imu_noise stays at its defaults.
Result<StereoRig> parse_kalibr_camchain(YamlReader yaml, const ReadBeside& read = {});
/// Kalibr's or OpenVINS' imu.yaml, with or without the level of the IMU's name. RealSense's JSON of an IMU has axes alone: the
/// rest is `otherwise`.
Result<ImuNoise> parse_imu(YamlReader yaml, const ImuNoise& otherwise = {}, const std::string& name = "imu0");

}  // namespace fbvins
