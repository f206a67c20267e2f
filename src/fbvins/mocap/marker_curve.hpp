// SPDX-License-Identifier: Apache-2.0
// A track of markers as a function of time: around every instant a parabola through the nearest poses, which averages their
// noise. Pure after construction, any thread.
#pragma once

#include <optional>

#include "fbvins/types/motion_capture.hpp"

namespace fbvins {

class MarkerCurve {
 public:
  explicit MarkerCurve(MarkerTrack track);

  /// Nullopt outside of the track, in gaps and at their edges.
  std::optional<Pose<V, K>> at(Time t) const;
  /// Half the span whose poses enter: instants at least twice this apart have independent noise.
  Duration half_window() const { return half_window_; }
  const MarkerTrack& track() const { return track_; }

 private:
  MarkerTrack track_;
  Duration half_window_, largest_hole_;
};

}  // namespace fbvins
