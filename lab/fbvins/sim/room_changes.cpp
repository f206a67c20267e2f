// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/room_changes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace fbvins {
namespace {

/// Of furniture from the path; of a camera from a surface and from a wall.
constexpr double kFurnitureClearance_m = 0.55, kCameraClearance_m = 0.35;
constexpr int kTries = 40;

void switch_off(World& world, int group) {
  std::erase_if(world.lamps, [&](const Lamp& l) { return l.group == group; });
  for (Facet& f : world.facets)
    if (f.lamp_group == group) f.emission = 0;
}

/// So far from a random wall of a random room.
Vec3 near_a_wall(const World& world, double from_wall_m, double z, Rng& rng) {
  const FloorRect& r = world.plan.rooms[rng.below(static_cast<std::uint32_t>(world.plan.rooms.size()))];
  const double along = rng.uniform(0.2, 0.8);
  const double x = r.x0 + along * (r.x1 - r.x0), y = r.y0 + along * (r.y1 - r.y0);
  switch (rng.below(4)) {
    case 0: return {r.x0 + from_wall_m, y, z};
    case 1: return {r.x1 - from_wall_m, y, z};
    case 2: return {x, r.y0 + from_wall_m, z};
    default: return {x, r.y1 - from_wall_m, z};
  }
}

/// What a piece of furniture occupies.
struct Extent {
  Vec2 centre = Vec2::Zero();
  double radius_m = 0, top_m = 0;
};

Extent extent_of(const World& world, const FurniturePiece& piece) {
  Extent e;
  std::vector<Vec3> corners;
  for (std::size_t i = piece.first; i < piece.first + piece.count; ++i) {
    const Facet& f = world.facets[i];
    for (const Vec3& p : {f.corner, Vec3(f.corner + f.u), Vec3(f.corner + f.v), Vec3(f.corner + f.u + f.v)}) corners.push_back(p);
  }
  for (const Vec3& p : corners) e.centre += p.head<2>() / static_cast<double>(corners.size());
  for (const Vec3& p : corners) {
    e.radius_m = std::max(e.radius_m, (p.head<2>() - e.centre).norm());
    e.top_m = std::max(e.top_m, p.z());
  }
  return e;
}

bool off_the_path(const Extent& e, const Vec2& at, const std::vector<Vec3>& path) {
  return std::none_of(path.begin(), path.end(), [&](const Vec3& p) {
    return p.z() < e.top_m + kFurnitureClearance_m && (p.head<2>() - at).norm() < e.radius_m + kFurnitureClearance_m;
  });
}

std::optional<Vec2> place_for(const World& world, const Extent& e, const std::vector<Vec3>& path, Rng& rng) {
  for (int i = 0; i < kTries; ++i) {
    const FloorRect& r = world.plan.rooms[rng.below(static_cast<std::uint32_t>(world.plan.rooms.size()))];
    if (std::min(r.x1 - r.x0, r.y1 - r.y0) < 2 * e.radius_m) continue;
    const double x = rng.uniform(r.x0 + e.radius_m, r.x1 - e.radius_m), y = rng.uniform(r.y0 + e.radius_m, r.y1 - e.radius_m);
    if (off_the_path(e, {x, y}, path)) return Vec2(x, y);
  }
  return std::nullopt;
}

void put(World& world, const FurniturePiece& piece, const Vec2& from, const Vec2& to, double turn_rad) {
  const Quat q = so3_exp(Vec3(0, 0, turn_rad));
  const Vec3 before(from.x(), from.y(), 0), after(to.x(), to.y(), 0);
  for (std::size_t i = piece.first; i < piece.first + piece.count; ++i) {
    Facet& f = world.facets[i];
    f.corner = q * (f.corner - before) + after;
    f.u = q * f.u;
    f.v = q * f.v;
  }
}

void take_out(World& world, std::size_t index) {
  const FurniturePiece gone = world.furniture[index];
  const auto begin = world.facets.begin() + static_cast<std::ptrdiff_t>(gone.first);
  world.facets.erase(begin, begin + static_cast<std::ptrdiff_t>(gone.count));
  world.furniture.erase(world.furniture.begin() + static_cast<std::ptrdiff_t>(index));
  for (FurniturePiece& p : world.furniture)
    if (p.first > gone.first) p.first -= gone.count;
}

double distance_m(const Facet& f, const Vec3& p) {
  const Vec3 d = p - f.corner;
  const double a = std::clamp(d.dot(f.u) / f.u.squaredNorm(), 0.0, 1.0), b = std::clamp(d.dot(f.v) / f.v.squaredNorm(), 0.0, 1.0);
  return (d - a * f.u - b * f.v).norm();
}

}  // namespace

void change_lamps(World& world, LampChange change, Rng& rng) {
  if (change == LampChange::none) return;
  switch_off(world, kLampsB);
  if (change == LampChange::half) return;
  const std::size_t count = world.lamps.size() + 1;
  switch_off(world, kLampsA);
  if (change == LampChange::sun) {
    world.lamps.push_back({near_a_wall(world, 0.15, 0.75 * world.plan.height_m, rng), 45, kLampsA});
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double z = rng.uniform(0.5, 1.9), power = rng.uniform(2.5, 7);
    world.lamps.push_back({near_a_wall(world, 0.5, z, rng), power, kLampsA});
  }
}

void move_furniture(World& world, double share, const std::vector<Vec3>& path, Rng& rng) {
  std::vector<std::size_t> order(world.furniture.size());
  std::iota(order.begin(), order.end(), 0u);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.below(static_cast<std::uint32_t>(i))]);
  order.resize(static_cast<std::size_t>(std::lround(share * static_cast<double>(order.size()))));
  std::sort(order.rbegin(), order.rend());  // from the end, so that what is taken out moves none that follows
  for (const std::size_t i : order) {
    const Extent extent = extent_of(world, world.furniture[i]);
    const double turn_rad = rng.uniform(-std::numbers::pi, std::numbers::pi);
    if (const auto to = place_for(world, extent, path, rng)) put(world, world.furniture[i], extent.centre, *to, turn_rad);
    else take_out(world, i);
  }
}

bool has_room_for_camera(const World& world, const Vec3& p) {
  const bool inside =
      world.plan.inside(p.x(), p.y()) && p.z() > kCameraClearance_m && p.z() < world.plan.height_m - kCameraClearance_m;
  return inside && std::none_of(world.facets.begin(), world.facets.end(),
                                [&](const Facet& f) { return distance_m(f, p) < kCameraClearance_m; });
}

}  // namespace fbvins
