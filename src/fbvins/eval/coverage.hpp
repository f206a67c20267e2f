// SPDX-License-Identifier: Apache-2.0
// Share of the recording that has a pose at all: a small error over half a flight is no success.
//
//   Coverage c = coverage_of(image_stamps, estimate_stamps);   // c.share, c.first_pose_after_s
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"

namespace fbvins {

struct Coverage {
  int images = 0;
  int with_pose = 0;
  double share = 0;               ///< with_pose / images, in [0, 1]
  double first_pose_after_s = 0;  ///< first image with a pose, after the first image; 0 where there is none
  double longest_hole_s = 0;      ///< longest time between two poses after the first
};

/// An image has a pose when one carries its stamp to within `tolerance` (files in seconds round).
Coverage coverage_of(std::vector<Time> images, std::vector<Time> poses, Duration tolerance = {1'000'000});

}  // namespace fbvins
