// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/floor_plan.hpp"

#include <algorithm>

namespace fbvins {
namespace {

std::vector<double> sorted_cuts(std::vector<double> cuts) {
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  return cuts;
}

/// Appends a piece, joined to the last one if it continues in the same direction.
void extend(std::vector<WallRun>& runs, const Vec2& a, const Vec2& b) {
  if (!runs.empty() && (runs.back().b - a).norm() < 1e-9 &&
      ((runs.back().b - runs.back().a).normalized() - (b - a).normalized()).norm() < 1e-9)
    runs.back().b = b;
  else runs.push_back({a, b});
}

}  // namespace

bool FloorPlan::inside(double x, double y) const {
  return std::any_of(rooms.begin(), rooms.end(), [&](const FloorRect& r) { return r.contains(x, y); });
}

// The rectangles' edges divide the plane into cells; a wall is between a free cell and an occupied one.
std::vector<WallRun> wall_runs(const FloorPlan& plan) {
  std::vector<double> xs, ys;
  for (const FloorRect& r : plan.rooms) {
    xs.insert(xs.end(), {r.x0, r.x1});
    ys.insert(ys.end(), {r.y0, r.y1});
  }
  xs = sorted_cuts(xs);
  ys = sorted_cuts(ys);
  const int nx = static_cast<int>(xs.size()) - 1, ny = static_cast<int>(ys.size()) - 1;
  const auto is_free = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < nx && j < ny && plan.inside(0.5 * (xs[i] + xs[i + 1]), 0.5 * (ys[j] + ys[j + 1]));
  };
  std::vector<WallRun> runs;
  for (int j = 0; j <= ny; ++j) {  // walls along x: free above, then free below
    for (int i = 0; i < nx; ++i)
      if (is_free(i, j) && !is_free(i, j - 1)) extend(runs, {xs[i], ys[j]}, {xs[i + 1], ys[j]});
    for (int i = nx - 1; i >= 0; --i)
      if (!is_free(i, j) && is_free(i, j - 1)) extend(runs, {xs[i + 1], ys[j]}, {xs[i], ys[j]});
  }
  for (int i = 0; i <= nx; ++i) {
    for (int j = 0; j < ny; ++j)
      if (!is_free(i, j) && is_free(i - 1, j)) extend(runs, {xs[i], ys[j]}, {xs[i], ys[j + 1]});
    for (int j = ny - 1; j >= 0; --j)
      if (is_free(i, j) && !is_free(i - 1, j)) extend(runs, {xs[i], ys[j + 1]}, {xs[i], ys[j]});
  }
  return runs;
}

FloorPlan room_around(const std::vector<Vec3>& path, double margin_m, double height_m) {
  Vec3 lo = path.front(), hi = path.front();
  for (const Vec3& p : path) {
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  FloorPlan plan;
  plan.rooms = {{lo.x() - margin_m, lo.y() - margin_m, hi.x() + margin_m, hi.y() + margin_m}};
  plan.height_m = std::max(height_m, hi.z() + 0.7);
  return plan;
}

FloorPlan corridor_ring(double length_x_m, double length_y_m, double height_m) {
  const double hx = 0.5 * length_x_m, hy = 0.5 * length_y_m, w = 1.1, door = 0.65, deep = 5.0;
  FloorPlan plan;
  plan.height_m = height_m;
  plan.rooms = {{-hx - w, -hy - w, hx + w, -hy + w},
                {-hx - w, hy - w, hx + w, hy + w},  // along x
                {-hx - w, -hy - w, -hx + w, hy + w},
                {hx - w, -hy - w, hx + w, hy + w}};  // along y
  const double z = 1.4;
  const auto add_room = [&](double x, double y, double side) {  // through a door in the wall of an x corridor
    const double wall = y + side * w, inner = wall + side * 0.3, far = inner + side * deep;
    plan.rooms.push_back({x - door, std::min(wall, inner) - 0.01, x + door, std::max(wall, inner) + 0.01});
    plan.rooms.push_back({x - 2.6, std::min(inner, far), x + 2.6, std::max(inner, far)});
    const double mid = inner + side * 0.5 * deep;
    for (const Vec2& p : {Vec2(x, y), Vec2(x, inner + side * 0.8), Vec2(x - 1.2, mid), Vec2(x, far - side * 1.3),
                          Vec2(x + 1.2, mid), Vec2(x, inner + side * 0.8), Vec2(x, y)})
      plan.tour.emplace_back(p.x(), p.y(), z);
  };
  plan.tour.emplace_back(-hx, -hy, z);
  add_room(0.1 * hx, -hy, -1);
  plan.tour.emplace_back(hx, -hy, z);
  plan.tour.emplace_back(hx, hy, z);
  add_room(-0.2 * hx, hy, 1);
  plan.tour.emplace_back(-hx, hy, z);
  return plan;
}

}  // namespace fbvins
