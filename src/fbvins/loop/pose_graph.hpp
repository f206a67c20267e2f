// SPDX-License-Identifier: Apache-2.0
// Keyframes as nodes, relative poses as edges; least squares over all of them (docs/derivations/loop.md, L8-L11, L22).
// Four degrees of freedom a node by default: roll and pitch are known from gravity, to within an error that
// the covariance of loops contains. With six, gravity is a measurement of every node. Anchors measure a node by itself, in the
// frame of the building. Edges marked as loops and anchors may be wrong: graduated non-convexity (H. Yang et al., RA-L 2020, with
// Geman-McClure) finds weights that leave false ones out. One thread; the same input gives the same bits.
//
//   PoseGraph graph;
//   int a = graph.add_node(T_MB_a, up_a), b = graph.add_node(T_MB_b, up_b);
//   graph.add_edge({a, b, T_ab, information, true});
//   PoseGraphReport report = graph.optimise({});
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/map_report.hpp"
#include "fbvins/loop/partial_pose.hpp"

namespace fbvins {

struct PoseGraphOptions {
  int degrees_of_freedom = 4;  ///< 4: position and yaw; 6: roll and pitch as well
};

struct PoseGraphEdge {
  int a = 0, b = 0;
  Pose<B, B> T_ab;
  Mat6 information = Mat6::Identity();                    ///< of (dp in a, dtheta in b)
  bool loop = false;                                      ///< may be an outlier
  double weight = 1;                                      ///< found by optimise(): 0 a false loop, 1 a good one
  std::optional<std::size_t> scale_a = {}, scale_b = {};  ///< by which the ends measure lengths; none: metres
};

/// The unit of a flight of one camera, as the logarithm of its length in M.
struct PoseGraphScale {
  double log = 0, sigma = 0;
  bool fixed = false;
};

struct PoseGraphAnchor {
  int node = 0;
  PartialPose measured;
  bool certain = false;      ///< cannot be an outlier
  double weight = 1;         ///< as of an edge
  Mat6 root = Mat6::Zero();  ///< of the information, with the error of roll and pitch; set by optimise()
};

class PoseGraph {
 public:
  /// `up_B`: the vertical, upwards, as the odometry estimates it.
  int add_node(const Pose<M, B>& T_MB, const Vec3& up_B, bool fixed = false);
  void add_edge(PoseGraphEdge edge) { edges_.push_back(edge); }

  /// Of a flight whose lengths are off by a common factor, of this relative standard deviation.
  std::size_t add_scale(PoseGraphScale scale) {
    scales_.push_back(scale);
    return scales_.size() - 1;
  }

  void add_anchor(PoseGraphAnchor anchor) { anchors_.push_back(std::move(anchor)); }

  /// Fixed nodes stay. Fix one in each connected part, or give it anchors: without them the gauge is free.
  PoseGraphReport optimise(const PoseGraphOptions& options);

  const std::vector<Pose<M, B>>& poses() const { return poses_; }
  const std::vector<PoseGraphEdge>& edges() const { return edges_; }
  /// Squared Mahalanobis length of an edge's residual at the present poses.
  double chi2(const PoseGraphEdge& edge, const PoseGraphOptions& options) const;
  double chi2(const PoseGraphAnchor& anchor) const;
  const std::vector<PoseGraphAnchor>& anchors() const { return anchors_; }
  const std::vector<PoseGraphScale>& scales() const { return scales_; }

 private:
  Mat6 weighted_information(const PoseGraphEdge& edge, const PoseGraphOptions& options) const;
  Mat6 information_of(const PoseGraphAnchor& anchor, const PoseGraphOptions& options) const;
  Vec6 residual_of(const PoseGraphEdge& edge) const;
  void weigh(double mu, const PoseGraphOptions& options);
  int solve(const PoseGraphOptions& options, PoseGraphReport& report);

  std::vector<Pose<M, B>> poses_;
  std::vector<Vec3> up_B_;  ///< the vertical as the odometry estimated it
  std::vector<bool> fixed_;
  std::vector<PoseGraphEdge> edges_;
  std::vector<PoseGraphAnchor> anchors_;
  std::vector<PoseGraphScale> scales_;
};

/// (dp in a, dtheta in b) of an edge at two poses.
Vec6 edge_residual(const Pose<M, B>& T_Ma, const Pose<M, B>& T_Mb, const Pose<B, B>& T_ab);

}  // namespace fbvins
