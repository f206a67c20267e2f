// SPDX-License-Identifier: Apache-2.0
// Private to bags: other programs' calibration files to values, checked. Pure functions.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/bags/bag_messages.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/mask_fields.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {

/// kalibr_imucam_chain.yaml: Kalibr's, but T_imu_cam takes camera to IMU coordinates. Noise figures stay at their defaults.
Result<StereoRig> parse_openvins_cameras(YamlReader yaml, const ReadBeside& read = {});

/// calibration.json (github.com/VladyslavUsenko/basalt, doc/Calibration.md): cameras of the models pinhole, pinhole-radtan8
/// without its higher coefficients, kb4, ds and eucm.
Result<StereoRig> parse_basalt(YamlReader yaml);

/// The estimator's configuration and its cameras' files, one or two (camodocal): PINHOLE, KANNALA_BRANDT and MEI. Its noise
/// figures are those of single readings at 200 Hz.
Result<StereoRig> parse_vins_fusion(YamlReader configuration, std::vector<YamlReader> cameras);

/// VINS-Mono's single configuration: lens, extrinsicRotation and extrinsicTranslation (camera to body), noise as VINS-Fusion's.
/// The stamp of a rolling shutter's image is its first row's there.
Result<StereoRig> parse_vins_mono(YamlReader configuration);

/// ORB-SLAM3's configuration, of one camera or two.
Result<StereoRig> parse_orbslam(YamlReader yaml);

/// LeftCameraParams.yaml and, where they are there, RightCameraParams.yaml and ImuParams.yaml of Kimera-VIO.
Result<StereoRig> parse_kimera(std::vector<YamlReader> cameras, std::optional<YamlReader> imu);

/// The calibration of an OAK as JSON: the left and the right camera.
Result<StereoRig> parse_oak(YamlReader yaml);

/// What a camera_info file says, and what it lacks for a calibration of a camera and an IMU: always an error.
Error camera_info_alone(YamlReader yaml);

/// One camera of it, without its place; rectified as the file's R and P say.
Result<BagCamera> parse_camera_info_file(YamlReader yaml);

/// camera_info as camera_calibration writes it: C1 against C0 comes from rectification and projection.
Result<StereoRig> parse_camera_info(YamlReader left, YamlReader right, const Pose<B, C0>& T_BC0);

}  // namespace fbvins
