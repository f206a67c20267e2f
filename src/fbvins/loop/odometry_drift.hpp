// SPDX-License-Identifier: Apache-2.0
// How fast the odometry of a flight drifts, by its own covariance (docs/derivations/loop.md, L20). What is assumed without one
// has to suit a poor odometry; a good one would be bent by loops that are worse than it.
//
//   OdometryDrift drift(options.drift);
//   drift.take(keyframe.pose_covariance, keyframe.gauge, path_m);     // every keyframe of a flight
//   MapEdge edge = odometry_edge(from, T_GB, t, drift.rate());
#pragma once

#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/types/gauge.hpp"

namespace fbvins {

class OdometryDrift {
 public:
  explicit OdometryDrift(const DriftOptions& assumed) : assumed_(assumed), rate_(assumed) {}

  /// A flight begins.
  void restart() { rate_ = assumed_, known_ = false; }
  /// `covariance`: of gauge.T_GB, as (dp in G, dtheta in B), since G began; zero: unknown. `path_m`: flown since then.
  void take(const Mat6& covariance, const GaugeState& gauge, double path_m);
  const DriftOptions& rate() const { return rate_; }

 private:
  DriftOptions assumed_, rate_;
  bool known_ = false;
};

}  // namespace fbvins
