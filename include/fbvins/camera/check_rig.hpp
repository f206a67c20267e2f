// SPDX-License-Identifier: Apache-2.0
// Whether a rig can be flown with: the border that every rig passes, wherever it comes from.
//
//   if (Result<void> good = check_rig(rig, file); !good) return good.error();
#pragma once

#include <string_view>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// An error, which begins with `origin`, where a number is not finite, a camera has no pixels or no focal length, its principal
/// point is outside the middle third of the image, its distortion is none that a lens has, its mask has another size or hides all
/// of the image, the cameras' centres coincide or lie apart by more than 10 m, or a figure of the IMU's noise is not positive,
/// its scale and axes are none that an IMU has, or a figure of a depth sensor is not positive. A rig has one to kMostCameras
/// cameras, one with a depth sensor.
Result<void> check_rig(const StereoRig& rig, std::string_view origin);
/// Of the IMU alone: its noise, and scale, axes and biases that an IMU can have (ImuIntrinsics).
Result<void> check_imu(const ImuNoise& noise, std::string_view origin);

}  // namespace fbvins
