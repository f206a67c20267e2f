// SPDX-License-Identifier: Apache-2.0
// The lens of the same camera whose images were made larger or smaller as a whole. Pure functions, any thread.
//
//   std::optional<Camera> half = scaled_to(camera, 376, 240);      // none where that is no image of the same shape
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// With focal lengths and centre for images that are `factor` times as large; the camera's size and mask stay. The upper left
/// corner of the image stays where it is, which is at (-0.5, -0.5) px.
Camera with_scaled_lens(const Camera& camera, double factor);

/// The camera with images of another size, lens and mask scaled to them. None where width and height are not scaled by one
/// factor, to a pixel: such an image was cut out or squeezed.
std::optional<Camera> scaled_to(const Camera& camera, int width, int height);

/// The camera with images that are the middle of its own, and its mask cut likewise. None where they are larger, or less than
/// half as wide or as high.
std::optional<Camera> middle_of(const Camera& camera, int width, int height);

}  // namespace fbvins
