// SPDX-License-Identifier: Apache-2.0
// Private: two cameras' images in one, the left camera's on the left. Pure functions.
//
//   if (is_side_by_side(image.width(), image.height(), rig)) left = half_of(image, 0), right = half_of(image, 1);
#pragma once

#include <cstdint>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Twice as wide as the images of a pair of cameras.
bool is_side_by_side(std::int64_t width, std::int64_t height, const StereoRig& rig);

/// Of camera 0 or 1.
Image half_of(const Image& both, int camera);

}  // namespace fbvins
