// SPDX-License-Identifier: Apache-2.0
// Whether left and right were exchanged: features are matched along the epipolar lines of the rig, and of the rig with its
// cameras exchanged. Pure functions, any thread.
//
//   StereoOrder order = stereo_order(rig, frames);
//   if (order.swapped()) frame.swap_left_right();
#pragma once

#include <optional>
#include <span>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct StereoOrder {
  int features = 0;      ///< of the images called left
  int as_named = 0;      ///< of these matched as the calibration has the cameras
  int as_swapped = 0;    ///< and with the cameras exchanged
  bool swapped() const;  ///< whether the images must be exchanged
};

StereoOrder stereo_order(const StereoRig& rig, std::span<const StereoFrame> frames);

std::optional<Finding> check_stereo_order(const StereoOrder& order);

}  // namespace fbvins
