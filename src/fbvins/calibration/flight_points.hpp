// SPDX-License-Identifier: Apache-2.0
// Private: the points of a piece of a flight, triangulated, and which of them to use: those seen longest, until every keyframe
// has enough. Pure function, any thread.
#pragma once

#include <vector>

#include "fbvins/calibration/flight_rig.hpp"
#include "fbvins/calibration/flight_tracks.hpp"

namespace fbvins {

struct SeenPoint {
  struct View {
    int keyframe = 0, camera = 0;
    Vec2 pixel = Vec2::Zero();
  };
  Vec3 p_W = Vec3::Zero();
  std::vector<View> views;  ///< by keyframe
};

std::vector<SeenPoint> seen_points(const std::vector<FlightKeyframe>& keyframes, const FlightRig& rig);

}  // namespace fbvins
