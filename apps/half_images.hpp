// SPDX-License-Identifier: Apache-2.0
// Recordings with images of half the width and height: a quarter of the bytes. Pure functions.
#pragma once

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins::app {

/// Lenses and masks for such images; an error where an image is too small.
Result<StereoRig> with_half_images(StereoRig rig);
StereoFrame with_half_images(StereoFrame frame);

}  // namespace fbvins::app
