// SPDX-License-Identifier: Apache-2.0
// What is wrong with a track of markers by itself: gaps, poses that are held, and jumps to another body or another assignment of
// the same markers. Pure functions, any thread.
//
//   MarkerInspection found = inspect(track);
//   MarkerTrack clean = found.kept(track);
//
// A flip that begins and ends inside gaps cannot be seen here; hand_eye.hpp finds it against the estimate.
#pragma once

#include <string>
#include <vector>

#include "fbvins/types/motion_capture.hpp"

namespace fbvins {

enum class MarkerFaultKind {
  gap,   ///< no pose
  held,  ///< the same pose again and again
  jump,  ///< faster than anything flies, for a while: another body, or the markers in another order
  flip,  ///< turned against the estimate
  swap,  ///< displaced against the estimate
};
std::string_view to_string(MarkerFaultKind kind);

struct MarkerFault {
  MarkerFaultKind kind = MarkerFaultKind::gap;
  Time from, to;          ///< by the clock of the motion capture
  double distance_m = 0;  ///< jump, swap
  double angle_rad = 0;   ///< jump, flip
};
/// "flip by 179.6 degrees, 12.310 s to 14.020 s", times counted from `start`.
std::string to_string(const MarkerFault& fault, Time start);

struct MarkerInspection {
  double rate_hz = 0;       ///< one over the median interval
  double jitter_s = 0;      ///< median deviation of the intervals from the median one
  double unseen_share = 0;  ///< of the time from first to last pose, in gaps
  std::vector<MarkerFault> faults;
  std::vector<bool> keep;

  MarkerTrack kept(const MarkerTrack& track) const;
};

/// Finds nothing in a track of fewer than two poses.
MarkerInspection inspect(const MarkerTrack& track);

}  // namespace fbvins
