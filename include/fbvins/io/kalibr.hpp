// SPDX-License-Identifier: Apache-2.0
// The rig of your own camera from Kalibr's files, checked. Any thread.
//
//   Result<StereoRig> rig = load_kalibr("camchain-imucam.yaml", "imu.yaml");
//   if (!rig) { report(rig.error().message); ... }   // "camchain.yaml:12: intrinsics: has 3 numbers ..."
//
// Frames: Kalibr's T_cam_imu takes IMU to camera coordinates and is inverted here. B is the IMU.
#pragma once

#include <optional>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// cam0 is left, cam1 right; without cam1 the rig has one camera. Without imu_path the noise figures are those under `imu0` in
/// the same file, where it has that, as `fbvins doctor --fix` writes it; `otherwise` if not.
Result<StereoRig> load_kalibr(const std::string& camchain_path, const std::optional<std::string>& imu_path = std::nullopt,
                              const ImuNoise& otherwise = {});

/// The IMU alone: noise and axes of Kalibr's or OpenVINS' imu.yaml; of RealSense's JSON the axes, and the rest is `otherwise`.
Result<ImuNoise> load_imu(const std::string& path, const ImuNoise& otherwise = {});

}  // namespace fbvins
