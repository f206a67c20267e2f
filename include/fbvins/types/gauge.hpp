// SPDX-License-Identifier: Apache-2.0
// A state in the estimator's own frame, the gauge G, with the estimated vertical in it. A map or a bundle adjustment, which has
// to agree with the observations, is built on this; a controller follows the published pose in W (odometry.hpp):
// G is the frame of the window, never turned and corrected at once; W is published, gravity-aligned and without jumps;
// M is W corrected by loop closure.
//
//   const Vec3 up_G = keyframe.gauge.up_G();                       // unit vector opposite to gravity
//   const Quat q_LB = keyframe.gauge.q_LG * keyframe.gauge.T_GB.q; // gravity-aligned attitude, by the estimate at that moment
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// The frame of the estimator's window: never turned, not even to level it, and never smoothed. Its origin and heading
/// are those of W when a flight begins.
struct G {};

struct GaugeState {
  Pose<G, B> T_GB;
  Vec3 v_GB = Vec3::Zero();      ///< m/s, in G
  Quat q_LG = Quat::Identity();  ///< levels G: the shortest rotation that takes up_G to z; better known later in the flight
  double up_sigma_rad = 0;       ///< standard deviation of the direction up_G about its less certain axis

  Vec3 up_G() const { return q_LG.conjugate() * Vec3::UnitZ(); }
};

}  // namespace fbvins
