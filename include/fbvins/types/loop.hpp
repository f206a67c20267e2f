// SPDX-License-Identifier: Apache-2.0
// What loop closure publishes: M is the odometry corrected by places seen again. Loop closure never moves W.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/gauge.hpp"

namespace fbvins {

/// Relative pose of the body at two keyframes.
struct LoopConstraint {
  KeyframeId from, to;  ///< `to` is the newer one
  Pose<B, B> T_from_to;
  Mat6 information = Mat6::Zero();  ///< of (dp in the body of `from`, dtheta in the body of `to`)
  int inliers = 0;
};

/// A keyframe's pose in the map after the update.
struct CorrectedKeyframe {
  KeyframeId id;
  Time t;
  Pose<M, B> T_MB;
};

struct LoopStats {
  int keyframes = 0;        ///< in the map
  int candidates = 0;       ///< places compared with this keyframe in detail
  int accepted = 0;         ///< candidates that became constraints
  int refused = 0;          ///< verified by the images, but inconsistent with the odometry
  int anchors = 0;          ///< that moved M
  int anchors_refused = 0;  ///< that contradict the odometry and the others, or came too late
  bool optimised = false;
  double extract_ms = 0, recognise_ms = 0, verify_ms = 0, optimise_ms = 0;
  double total_ms() const { return extract_ms + recognise_ms + verify_ms + optimise_ms; }
};

/// After every keyframe. T_MB = T_MW * T_WB, or without the levelling and smoothing of W: T_MB = T_MG * T_GB (Odometry::gauge).
struct MapUpdate {
  FrameId frame;         ///< the keyframe
  FrameId applies_from;  ///< the first frame that comes after this update, in data time; set by the pipeline
  Time t;
  bool localised = false;  ///< false: where W is in M is not known (a loaded map, or after a restart)
  bool found = false;      ///< from this update on it is known again: after a restart, or for the first time in a loaded map
  Pose<M, G> T_MG;         ///< best estimate; jumps when a place is recognised
  Pose<M, W> T_MW;         ///< the same for W as it was published when the keyframe was handed on
  Pose<M, W> T_MW_smooth;  ///< follows T_MW at a bounded speed: for a controller
  bool anchored = false;   ///< M is the frame of the building
  /// M is another frame from this update on: takes coordinates in the M of before to those in the new one. A new map is levelled
  /// so, once or twice in its first seconds, and T_MW_smooth, which follows the newest vertical all the time, does not step;
  /// where M becomes the building's, T_MW_smooth jumps with it.
  std::optional<Pose<M, M>> M_moved = {};
  std::uint32_t reset_counter = 0;  ///< of the odometry: which frame W this refers to
  std::uint32_t map_session = 0;    ///< counts the odometry frames W that were joined to this map
  std::vector<LoopConstraint> loops;
  std::vector<CorrectedKeyframe> corrected;  ///< all keyframes, when the graph was optimised
  LoopStats stats;
};

}  // namespace fbvins
