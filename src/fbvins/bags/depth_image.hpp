// SPDX-License-Identifier: Apache-2.0
// Private to bags: pixels of depth images as ROS names them. Pure functions, any thread.
//
//   Result<DepthImage> depth = depth_image({640, 480, 1280, "16UC1", false, bytes});
#pragma once

#include "fbvins/bags/grey_image.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// 16UC1 and mono16 (librealsense's name of it) in millimetres, 32FC1 in metres: what is not finite, or beyond 65 m, is not
/// measured. An error for any other encoding, or for fewer pixels than the size needs.
Result<DepthImage> depth_image(const RawImage& raw);

}  // namespace fbvins
