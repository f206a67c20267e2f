// SPDX-License-Identifier: Apache-2.0
// Changes to a map that nobody flies in at the moment: a part of it, its axes; and how two maps differ. Pure functions.
//
//   PlaceMap hall = cut_map(map, {.low_M = {0, 0, -1}, .high_M = {20, 12, 5}});
//   Result<MapAlignment> done = align_map(map, {{p_M, p_building}, ...});
#pragma once

#include <limits>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

/// A box in M, m.
struct MapBox {
  Vec3 low_M = Vec3::Constant(-std::numeric_limits<double>::infinity());
  Vec3 high_M = Vec3::Constant(std::numeric_limits<double>::infinity());

  bool holds(const Vec3& p_M) const { return (p_M.array() >= low_M.array()).all() && (p_M.array() <= high_M.array()).all(); }
};

/// Without the keyframes outside of the box, or those inside of it. Neighbours of what is removed are joined directly.
PlaceMap cut_map(PlaceMap map, const MapBox& box, bool remove_inside = false);

/// A point in the map's axes and in those of a building.
struct SurveyedPoint {
  Vec3 p_M = Vec3::Zero(), p_building = Vec3::Zero();
};

struct MapAlignment {
  double heading_rad = 0;       ///< by which the map was turned, about the vertical
  Vec3 moved_m = Vec3::Zero();  ///< where its old origin lies now
  double rms_m = 0;             ///< distance of the points that remains
};

/// Turns the map about the vertical and moves it so that the points fit best: M stays gravity-aligned, and its scale is its own.
/// An error, and no change, for less than three points, points on one spot, and points that do not fit: with the wrong scale,
/// upside down or mirrored.
Result<MapAlignment> align_map(PlaceMap& map, const std::vector<SurveyedPoint>& points);

struct MapDifference {
  int in_both = 0, only_first = 0, only_second = 0;  ///< keyframes: the same image is the same keyframe
  int loops_first = 0, loops_second = 0;
  double rms_m = 0, largest_m = 0;  ///< by which keyframes of both moved
  double largest_deg = 0;
};
MapDifference compare_maps(const PlaceMap& first, const PlaceMap& second);

}  // namespace fbvins
