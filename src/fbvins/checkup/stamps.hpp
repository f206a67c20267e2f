// SPDX-License-Identifier: Apache-2.0
// Checks of the stamps of images and readings. Pure functions, any thread.
//
//   for (Finding& finding : check_stamps(samples, image_stamps, rig)) report(finding);
#pragma once

#include <optional>
#include <span>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

/// When images and readings begin and end.
struct StampEnds {
  Time first_image, last_image, first_reading, last_reading;
};

/// Whether there are readings for every image: an IMU that began late or ended early, or clocks that are apart.
std::optional<Finding> check_ends(const StampEnds& ends, const StereoRig& rig);

/// Rate and repetition of readings, regularity of images, and whether both have the same clock.
/// `ends`: of the whole recording, where these are a part of it.
std::vector<Finding> check_stamps(std::span<const ImuSample> samples, std::span<const Time> images, const StereoRig& rig,
                                  const std::optional<StampEnds>& ends = std::nullopt);

}  // namespace fbvins
