// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/flight/mission.hpp"

namespace fbvins {
namespace {

constexpr double kTimeToSpare_s = 120;
constexpr double kStep_m = 0.25;  ///< between points along the path
/// From the vehicle's centre: its size and a margin for estimation errors and gusts.
constexpr double kWallClearance_m = 0.45, kCeilingClearance_m = 0.3;

FloorPlan plan_of(const Mission& mission, const PlaceDefaults& defaults, const std::vector<Vec3>& path_W) {
  const MissionPlace& place = mission.place;
  const std::string kind = place.kind.empty() ? defaults.kind : place.kind;
  if (kind == "corridors") {
    const Vec3 size = place.size_m.value_or(Vec3(defaults.extent_x_m, defaults.extent_y_m, defaults.height_m));
    return corridor_ring(size.x(), size.y(), std::max(size.z(), 2.6));
  }
  if (!place.size_m) return room_around(path_W, defaults.margin_m, defaults.height_m);
  const Vec3 half = 0.5 * *place.size_m;
  FloorPlan plan;
  plan.rooms = {{-half.x(), -half.y(), half.x(), half.y()}};
  plan.height_m = place.size_m->z();
  return plan;
}

/// There is no wall within the clearance.
bool is_clear(const FloorPlan& plan, const Vec3& p) {
  for (int k = 0; k < 16; ++k) {
    const double angle = k * 3.14159265358979 / 8;
    if (!plan.inside(p.x() + kWallClearance_m * std::cos(angle), p.y() + kWallClearance_m * std::sin(angle))) return false;
  }
  return plan.inside(p.x(), p.y());
}

/// Margin of the default geofence around the planned path.
constexpr double kAroundTheWay_m = 1.5;

std::string place_text(const Vec3& p) { return fmt::format("({:.2f}, {:.2f}, {:.2f})", p.x(), p.y(), p.z()); }

}  // namespace

std::vector<MissionPoint> path_points(const Mission& mission) {
  std::vector<MissionPoint> places{{Vec3::Zero(), 0}};
  const auto go = [&](const Vec3& to, int step) {
    const Vec3 from = places.back().p;
    const int n = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kStep_m)));
    for (int k = 1; k <= n; ++k) places.push_back({from + (to - from) * k / n, step});
  };
  for (std::size_t i = 0; i < mission.steps.size(); ++i) {
    const MissionStep& step = mission.steps[i];
    const int index = static_cast<int>(i);
    if (step.kind == MissionStep::Kind::takeoff) go(Vec3(0, 0, step.height_m), index);
    for (const Vec3& p : step.points) go(p, index);
    if (step.kind == MissionStep::Kind::land) go(Vec3(places.back().p.x(), places.back().p.y(), 0), index);
  }
  return places;
}

double longest_flight_s(const Mission& mission) {
  double seconds = kTimeToSpare_s;
  const std::vector<MissionPoint> places = path_points(mission);
  const double slowest = std::min({mission.limits.speed_mps, mission.limits.climb_mps, mission.limits.land_mps});
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double own = mission.steps[static_cast<std::size_t>(places[i].step)].speed_mps;
    seconds += 2 * (places[i].p - places[i - 1].p).norm() / (own > 0 ? std::min(own, slowest) : slowest);
  }
  for (const MissionStep& step : mission.steps) seconds += 10 + 2 * step.seconds;
  return seconds;
}

Geofence fence_of(const Mission& mission) {
  if (mission.geofence) return *mission.geofence;
  Geofence fence{Vec3::Zero(), Vec3::Zero()};
  for (const MissionPoint& place : path_points(mission)) {
    fence.low = fence.low.cwiseMin(place.p);
    fence.high = fence.high.cwiseMax(place.p);
  }
  return {fence.low - Vec3::Constant(kAroundTheWay_m), fence.high + Vec3::Constant(kAroundTheWay_m)};
}

Result<MissionSite> site_of(const Mission& mission, const PlaceDefaults& defaults, double standing_height_m) {
  MissionSite site;
  site.origin_W = Vec3(mission.place.start_m.x(), mission.place.start_m.y(), standing_height_m);
  site.heading_rad = mission.place.heading_rad;
  const std::vector<MissionPoint> places = path_points(mission);
  std::vector<Vec3> path_W;
  for (const MissionPoint& place : places) path_W.push_back(site.to_world(place.p));
  site.plan = plan_of(mission, defaults, path_W);

  for (std::size_t i = 0; i < places.size(); ++i) {
    const MissionStep& step = mission.steps[static_cast<std::size_t>(places[i].step)];
    const auto wrong = [&](const std::string& what) {
      return Error{ErrorCode::invalid_argument,
                   fmt::format("{}:{}: {} at {}", mission.source, step.line, what, place_text(places[i].p))};
    };
    if (!is_clear(site.plan, path_W[i])) return wrong("the path leads through a wall, or too near to one,");
    if (path_W[i].z() > site.plan.height_m - kCeilingClearance_m) return wrong("the path leads too near to the ceiling");
    if (mission.geofence && i > 0 && places[i].p.z() > 0 && !mission.geofence->contains(places[i].p))
      return wrong("the path leads out of the geofence");
  }
  return site;
}

}  // namespace fbvins
