// SPDX-License-Identifier: Apache-2.0
// How fast the odometry of a flight drifts, by its own covariance (docs/derivations/loop.md, L20). What is assumed without one
// has to suit a poor odometry; a good one would be bent by loops that are worse than it.
//
//   OdometryDrift drift(options.drift);
//   drift.take(keyframe.pose_covariance, keyframe.gauge, path_m);     // every keyframe of a flight
//   MapEdge edge = odometry_edge(from, T_GB, t, drift.rate());
#pragma once

#include <optional>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/types/gauge.hpp"

namespace fbvins {

class OdometryDrift {
 public:
  explicit OdometryDrift(const DriftOptions& assumed) : assumed_(assumed), rate_(assumed) {}

  /// `covariance`: of gauge.T_GB, as (dp in G, dtheta in B); zero: unknown. What it was at first does not count, because G may
  /// be older than the flight: a correction can begin a new W in the same G. `path_m`: flown.
  void take(const Mat6& covariance, const GaugeState& gauge, double path_m);
  const DriftOptions& rate() const { return rate_; }

 private:
  struct Uncertainty {
    double path_m, position_m2, yaw_rad2;
  };

  DriftOptions assumed_, rate_;
  bool known_ = false;
  std::optional<Uncertainty> first_;
};

}  // namespace fbvins
