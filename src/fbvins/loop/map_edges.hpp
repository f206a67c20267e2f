// SPDX-License-Identifier: Apache-2.0
// Edges of the map from what was measured: the odometry between two keyframes, or a recognised place; and the pose of the body
// in M that a recognised place implies (docs/derivations/loop.md, L13). Pure functions.
//
//   MapEdge edge = loop_edge(map.T_BC(candidate), map.T_BC(query), candidate.id, verified.pose);
//   if (frame.mahalanobis2(measured_pose(candidate, edge)) < gate) map.edges.push_back(edge);
#pragma once

#include "fbvins/loop/map_frame.hpp"
#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_pose.hpp"

namespace fbvins {

/// Angle of the rotation that takes one attitude to the other, rad.
double angle_between(const Quat& a, const Quat& b);

/// From the keyframe before to a pose in the same gauge; `to` is left open.
MapEdge odometry_edge(const MapKeyframe& from, const Pose<G, B>& T_GB, Time t, const DriftOptions& drift);

/// From the candidate to the query's body; `to` is left open. `pose`: of the candidate's camera in the query's.
MapEdge loop_edge(const Pose<B, C0>& T_BC_candidate, const Pose<B, C0>& T_BC_query, KeyframeId candidate,
                  const RelativePose& pose);

/// Pose in M of the body at the end of `edge`, whose metre has this length in M, from that of `from`.
MeasuredPose measured_pose(const MapKeyframe& from, const MapEdge& edge, double metre = 1);

}  // namespace fbvins
