// SPDX-License-Identifier: Apache-2.0
// What a motion-capture system measures of one rigid body. Values.
//
//   Pose<V, K> T_VK = T_VW * T_WB * T_BK;   // its measurement, predicted from the odometry (docs/derivations/hand_eye.md)
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct V {};  ///< the motion-capture volume: z up as far as its ground plane was calibrated level
struct K {};  ///< the rigid body of markers, fixed to B at an unknown pose

struct MarkerPose {
  Time t;  ///< of the motion capture's own clock
  Pose<V, K> T_VK;
};

/// In order of time; where the body was not seen there is no pose.
using MarkerTrack = std::vector<MarkerPose>;

}  // namespace fbvins
