// SPDX-License-Identifier: Apache-2.0
// A trajectory: the poses of the body in one frame, in order of time, nothing else. The frame is part of the type, so
// that odometry and map are not mixed:
//
//   Trajectory<W> odometry;                                  // as the estimator publishes it
//   Trajectory<M> in_map = closer.corrected(in_gauge);       // a Trajectory<G>, in the estimator's own frame, after loop closure
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

template <class Frame>
struct StampedPose {
  Time t;
  Pose<Frame, B> T;  ///< takes body to Frame: T_WB in a Trajectory<W>, T_MB in a Trajectory<M>
};

template <class Frame>
using Trajectory = std::vector<StampedPose<Frame>>;

}  // namespace fbvins
