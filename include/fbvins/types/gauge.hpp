// SPDX-License-Identifier: Apache-2.0
// A state in the estimator's own frame, the gauge G, with what is known of up in it. What has to fit what was seen (a map, an
// adjustment) is built on this; what flies follows the published pose in W (odometry.hpp):
// G is the frame in which the window saw things, never turned and corrected at once; W is published, level and without leaps;
// M is W corrected by loop closure.
//
//   const Vec3 up_G = keyframe.gauge.up_G();                       // unit vector against gravity
//   const Quat q_LB = keyframe.gauge.q_LG * keyframe.gauge.T_GB.q; // attitude against the level, as known now
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// The frame in which the estimator's window saw things: never turned, not even level, and never smoothed. Its origin and heading
/// are those of W when a flight begins.
struct G {};

struct GaugeState {
  Pose<G, B> T_GB;
  Vec3 v_GB = Vec3::Zero();      ///< m/s, in G
  Quat q_LG = Quat::Identity();  ///< turns directions of G level, by the shortest way; known better as the flight goes on
  double up_sigma_rad = 0;       ///< standard deviation of up's direction in G, about its less known axis

  Vec3 up_G() const { return q_LG.conjugate() * Vec3::UnitZ(); }
};

}  // namespace fbvins
