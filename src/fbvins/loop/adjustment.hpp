// SPDX-License-Identifier: Apache-2.0
// A whole map as one least-squares problem: keyframes, points that two of them have seen, motions and biases between them and
// the direction of gravity (docs/derivations/loop.md, L16, L18, L19). Every eighth point is held out of the
// problem, to validate its solution. One thread; the same map in gives the same solution.
//
//   Adjustment adjustment(map);
//   for (const FeatureTrack& track : tracks) adjustment.add(track);
//   AdjustmentState x = adjustment.start();
//   adjustment.solve(x);
//   const Plausibility before = adjustment.judged(adjustment.start()), after = adjustment.judged(x);
#pragma once

#include <vector>

#include "fbvins/loop/adjustment_costs.hpp"
#include "fbvins/loop/feature_tracks.hpp"

namespace ceres {
class Problem;
}

namespace fbvins {

/// All unknowns: pose and motion of each keyframe, the points, the tilt of M. Motions of keyframes without readings are unused.
struct AdjustmentState {
  std::vector<PoseBlock> poses;
  std::vector<MotionBlock> motions;
  std::vector<PointBlock> points;
  TiltBlock tilt{0, 0};
};

class Adjustment {
 public:
  explicit Adjustment(const PlaceMap& map);

  void add(const FeatureTrack& track);
  bool empty() const { return observations_.empty(); }

  const AdjustmentState& start() const { return start_; }
  /// Returns the iterations. The first placed keyframe stays, unless anchors hold the map. `drift`: variance of the odometry's
  /// steps, in units of the drift that its edges were given.
  int solve(AdjustmentState& x, double drift = 1) const;
  /// That variance as a solution shows it, over stretches long enough for drift to exceed the solution's own scatter.
  double drift_found(const AdjustmentState& x) const;
  /// Removes observations that do not fit a solution: they are wrong matches.
  void drop_outliers(const AdjustmentState& x);
  Plausibility judged(AdjustmentState x) const;  ///< of the poses of x; all else is fitted to them (L19)
  /// Writes the poses of a solution into the map and aligns it with gravity.
  void write(const AdjustmentState& x, PlaceMap& map) const;

  std::size_t points() const;
  std::size_t observations() const { return observations_.size(); }
  /// Root of the mean squared distance in the image, over the observations there are now.
  double rms_px(const AdjustmentState& x) const;

 private:
  struct Observation {
    std::size_t keyframe, point;
    const PlaceFeature* feature;
  };
  struct Anchored {
    std::size_t keyframe;
    const PartialPose* measured;
  };
  struct Step {
    std::size_t from, to;
    const MapEdge* edge;
  };

  ObservationCost cost_of(const Observation& s) const {
    return {keyframe(s.keyframe).T_MB.q, map_.T_BC(keyframe(s.keyframe)), *s.feature};
  }
  const MapKeyframe& keyframe(std::size_t i) const { return map_.keyframes()[i]; }
  Pose<M, B> pose(const AdjustmentState& x, std::size_t i) const {
    return {orientation<6>(keyframe(i).T_MB.q, x.poses[i].data()), Vec3(x.poses[i].data())};
  }
  std::optional<PointBlock> first_point(const FeatureTrack& track) const;
  void add_observations(ceres::Problem& problem, const std::vector<Observation>& observations, AdjustmentState& x) const;
  void add_readings(ceres::Problem& problem, AdjustmentState& x) const;
  void add_edges(ceres::Problem& problem, AdjustmentState& x, double drift) const;
  void add_verticals(ceres::Problem& problem, AdjustmentState& x) const;
  void choose_anchors();
  void add_anchors(ceres::Problem& problem, AdjustmentState& x) const;
  static void hold_level(ceres::Problem& problem, AdjustmentState& x);
  double anchors_cost(const AdjustmentState& x) const;
  double held_out_cost(const AdjustmentState& x) const;
  double imu_cost(const AdjustmentState& x) const;
  double odometry_cost(const AdjustmentState& x) const;

  const PlaceMap& map_;
  AdjustmentState start_;
  std::vector<Observation> observations_, held_out_;
  std::vector<Step> steps_;         ///< all edges between placed keyframes
  std::vector<Anchored> anchors_;   ///< that fit
  std::vector<bool> has_readings_;  ///< of a keyframe: an edge to or from it has readings
};

}  // namespace fbvins
