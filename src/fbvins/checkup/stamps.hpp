// SPDX-License-Identifier: Apache-2.0
// Checks of the stamps of images and readings. Pure functions, any thread.
//
//   for (Finding& finding : check_stamps(samples, image_stamps, rig)) report(finding);
#pragma once

#include <span>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

/// Rate and repetition of readings, regularity of images, and whether both have the same clock.
std::vector<Finding> check_stamps(std::span<const ImuSample> samples, std::span<const Time> images, const StereoRig& rig);

}  // namespace fbvins
