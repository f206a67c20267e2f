// SPDX-License-Identifier: Apache-2.0
// Which time of one clock is which of another, from how fast a body turns: that is the same number in every frame, so neither
// the worlds nor where the markers sit need to be known. Pure functions, any thread.
#pragma once

#include "fbvins/core/result.hpp"
#include "fbvins/types/motion_capture.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

struct ClockMatch {
  Duration offset;         ///< estimate's time = motion capture's time + offset, to some milliseconds
  double correlation = 0;  ///< of the two turning rates there
  double overlap_s = 0;
};

/// Any offset is found at which the two have `kShortestOverlap_s` in common. An error where no offset stands out.
inline constexpr double kShortestOverlap_s = 8;
Result<ClockMatch> match_clocks(const MarkerTrack& track, const Trajectory<W>& estimate);

}  // namespace fbvins
