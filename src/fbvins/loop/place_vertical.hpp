// SPDX-License-Identifier: Apache-2.0
// The vertical of an older map in the gauge of a flight, as the places say that are recognised, and combined with gravity, which
// a flight knows to a degree or two in its first seconds (docs/derivations/loop.md, L35). A value; one thread at a time.
//
//   PlaceVertical vertical;
//   vertical.advance(drift_rad2);                          // every keyframe
//   vertical.add(keyframe.gauge, seen);                    // every recognised place of an older session
//   const LevelledGauge level = vertical.level(keyframe.gauge);
#pragma once

#include <limits>

#include "fbvins/loop/map_frame.hpp"

namespace fbvins {

/// Standard deviation of a map's vertical against gravity.
inline constexpr double kMapTilt_rad = 0.005;
/// Places that follow one another share the error with which they were mapped: factor on the covariance of each.
inline constexpr double kSharedError = 4;

struct LevelledGauge {
  Quat q_LG = Quat::Identity();  ///< the shortest rotation that takes up in G to z
  double up_sigma_rad = 0;       ///< standard deviation of that direction
};

class PlaceVertical {
 public:
  /// What the odometry's attitude drifts until the next keyframe.
  void advance(double drift_rad2) { variance_rad2_ += drift_rad2; }
  /// A place that contradicts gravity is not used.
  void add(const GaugeState& gauge, const MeasuredPose& seen);
  /// By the places and by gravity, each by its covariance.
  LevelledGauge level(const GaugeState& gauge) const;

 private:
  Vec3 up_G_ = Vec3::UnitZ();
  double variance_rad2_ = std::numeric_limits<double>::infinity();
};

}  // namespace fbvins
