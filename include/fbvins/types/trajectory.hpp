// SPDX-License-Identifier: Apache-2.0
// A trajectory as evaluation and files see it: poses in order of time, nothing else.
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

struct StampedPose {
  Time t;
  Pose<W, B> T_WB;
};

using Trajectory = std::vector<StampedPose>;

}  // namespace fbvins
