// SPDX-License-Identifier: Apache-2.0
// Private to calibration: whether a fit is plausible, and why not, in a sentence. Pure functions.
#pragma once

#include <optional>

#include "fbvins/calibration/imu_camera_fit.hpp"

namespace fbvins {

/// Gravity as the accelerometer reads it, and the board's true size over the given one, both estimated freely (C13).
struct Magnitudes {
  double gravity_mps2 = 0, gravity_sigma = 0, scale = 1, scale_sigma = 0;
};
Magnitudes magnitudes(const ImuCameraFit& fit);

/// Where images and readings contradict one another: because of the cameras' poses on one another, or for another reason.
std::optional<Error> check_agreement(const ImuCameraFit& fit);
std::optional<Error> check_magnitudes(const Magnitudes& measured, const Board& board, double gravity_mps2);
std::optional<Error> check_axes(const ImuTriads& axes);
/// Where the motion leaves a parameter uncertain.
std::optional<Error> check_determined(const CameraImuResult& result, const Vec3& turning_radps);

/// What all corners of an image are off by together, over their noise, where the fit is doubtful.
inline constexpr double kImagesDoubtful = 3;

/// Sentences for the user.
std::vector<std::string> remarks_on(const CameraImuResult& result);

}  // namespace fbvins
