// SPDX-License-Identifier: Apache-2.0
// Whether an infrared projector is on: its spots move with the camera, and features on them say that it does not move. Pure
// functions, any thread.
//
//   if (auto finding = check_dots(share_of_dots(rig.left(), frames))) report(*finding);
#pragma once

#include <optional>
#include <span>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// A spot of light: much brighter than all pixels four away from it, which are alike.
bool is_bright_dot(const PyramidLevel& image, const Vec2& px);

/// Of the corners in a left image, the least of those given: a projector lights all. 0 where there are few corners.
double share_of_dots(const Camera& camera, std::span<const StereoFrame> frames);

std::optional<Finding> check_dots(double share);

}  // namespace fbvins
