// SPDX-License-Identifier: Apache-2.0
// Offset of two clocks from a body's angular speed, which is the same in every frame, so that neither the worlds nor the
// markers' place on the body need to be known. Pure functions, any thread.
#pragma once

#include "fbvins/core/result.hpp"
#include "fbvins/types/motion_capture.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

struct ClockMatch {
  Duration offset;         ///< estimate's time = motion capture's time + offset, to some milliseconds
  double correlation = 0;  ///< of the two angular speeds there
};

/// Any offset is found at which the two have `kShortestOverlap_s` in common. An error where no offset stands out.
inline constexpr double kShortestOverlap_s = 8;
Result<ClockMatch> match_clocks(const MarkerTrack& track, const Trajectory<W>& estimate);

}  // namespace fbvins
