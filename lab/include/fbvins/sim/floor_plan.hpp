// SPDX-License-Identifier: Apache-2.0
// Floor plan: axis-parallel rectangles that overlap at doors. Values.
#pragma once

#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct FloorRect {
  double x0, y0, x1, y1;

  bool contains(double x, double y) const { return x > x0 && x < x1 && y > y0 && y < y1; }
  double area() const { return (x1 - x0) * (y1 - y0); }
};

struct FloorPlan {
  std::vector<FloorRect> rooms;
  double height_m = 3;
  std::vector<Vec3> tour;  ///< waypoints of a tour through all rooms

  bool inside(double x, double y) const;
};

/// A straight piece of wall from a to b, with the free side to its left.
struct WallRun {
  Vec2 a, b;
};

/// The outline of the union of the rooms, in straight pieces that are as long as possible.
std::vector<WallRun> wall_runs(const FloorPlan& plan);

/// One rectangle around the path.
FloorPlan room_around(const std::vector<Vec3>& path, double margin_m, double height_m);

/// A ring of four corridors with two rooms at its outer sides.
FloorPlan corridor_ring(double length_x_m, double length_y_m, double height_m);

}  // namespace fbvins
