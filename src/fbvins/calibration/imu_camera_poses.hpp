// SPDX-License-Identifier: Apache-2.0
// Private to calibration: where cameras and body were over the board, image by image, and from that the cameras' first extrinsics
// (docs/derivations/calibration.md, A1, A4). Pure functions.
#pragma once

#include <vector>

#include "fbvins/calibration/imu_camera_path.hpp"

namespace fbvins {

using CameraPoses = std::vector<std::vector<SeenPose>>;  ///< of each camera, by time

inline constexpr std::size_t kFewestBoardViews = 40;

/// From each image alone; some may be wrong. An error where a camera sees the board too rarely or not as it should look.
Result<CameraPoses> locate_all(const ImuCameraInput& input, Time reference);
/// Those that fit as well as most: of a few corners or blurred ones a pose may be far off.
CameraPoses good_ones(CameraPoses poses);
/// T_BC of each camera with its centre in the IMU; that of cameras on one another as given, or as seen.
Result<std::vector<Pose<B, Cn>>> first_extrinsics(const ImuCameraInput& input, const CameraPoses& poses, const GyroIntegral& gyro,
                                                  const TurnMatch& match);
/// Where the body was at the images, one pose an instant, on the IMU's clock.
std::vector<BodyPose> body_poses(const CameraPoses& poses, const std::vector<Pose<B, Cn>>& T_BC,
                                 const std::vector<double>& offsets_s);

}  // namespace fbvins
