// SPDX-License-Identifier: Apache-2.0
// The pieces that a RoomPopulator puts into a room (populate_room.hpp), each turned and sized at random.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/sim/populate_room.hpp"

namespace fbvins {
namespace {

Quat about_z(double angle) { return so3_exp(Vec3(0, 0, angle)); }

}  // namespace

bool RoomPopulator::add_shelf(const Wall& wall, double at) {
  const Vec3 x = wall.along.normalized();
  const double width = rng_.uniform(0.6, 1.2), depth = 0.17,
               height = std::min(rng_.uniform(1.0, 2.1), world_.plan.height_m - 0.2);
  if (at + width > wall.length()) return false;
  BoxShape shape;
  shape.centre = Vec3(wall.corner.x(), wall.corner.y(), 0.5 * height) + (at + 0.5 * width) * x + (depth + 0.03) * wall.inward();
  shape.half = Vec3(0.5 * width, depth, 0.5 * height);
  shape.q = about_z(std::atan2(x.y(), x.x()));
  if (!is_clear(shape.centre, shape.half.norm())) return false;
  const int what = plain_or({Surface::books, Surface::books, Surface::metal, Surface::panel});
  add_box(world_.facets, shape, what, tint(), std::max(0.7, width));
  return true;
}

bool RoomPopulator::add_table(const Vec3& floor_point) {
  const double w = rng_.uniform(0.4, 0.8), d = rng_.uniform(0.3, 0.45), h = rng_.uniform(0.65, 0.8);
  if (!is_clear(floor_point + Vec3(0, 0, h), std::hypot(w, d) + 0.2)) return false;
  const Quat q = about_z(rng_.uniform(0, std::numbers::pi));
  const int top = plain_or({Surface::wood}), leg = texture(Surface::metal);
  add_box(world_.facets, {floor_point + Vec3(0, 0, h), Vec3(w, d, 0.02), q}, top, tint(), 1.0);
  for (int i = 0; i < 4; ++i)
    add_box(world_.facets,
            {floor_point + q * Vec3((i & 1 ? 0.9 : -0.9) * w, (i & 2 ? 0.9 : -0.9) * d, 0.5 * h),
             Vec3(0.025, 0.025, 0.5 * h - 0.02), q},
            leg, 0.8f, 0.4);
  for (int i = 0; i < 4; ++i) {
    const double a = rng_.uniform(0.04, 0.14), b = rng_.uniform(0.04, 0.14), c = rng_.uniform(0.03, 0.2);
    const double x = rng_.uniform(-0.75, 0.75) * w, y = rng_.uniform(-0.7, 0.7) * d, angle = rng_.uniform(0, std::numbers::pi);
    const int what = plain_or({Surface::cardboard, Surface::books, Surface::panel, Surface::page, Surface::picture});
    add_box(world_.facets, {floor_point + Vec3(0, 0, h + 0.02 + c) + q * Vec3(x, y, 0), Vec3(a, b, c), about_z(angle)}, what,
            tint(), 0.35);
  }
  return true;
}

bool RoomPopulator::add_box_stack(const Vec3& floor_point) {
  double z = 0;
  for (int i = 1 + static_cast<int>(rng_.below(3)); i > 0; --i) {
    const double a = std::exp(rng_.uniform(std::log(0.1), std::log(0.4))), b = a * rng_.uniform(0.6, 1.5),
                 c = std::exp(rng_.uniform(std::log(0.08), std::log(0.45)));
    const Vec3 centre = floor_point + Vec3(0, 0, z + c);
    if (!is_clear(centre, Vec3(a, b, c).norm())) return i > 1;
    const double angle = rng_.uniform(0, std::numbers::pi);
    const int what = plain_or({Surface::cardboard, Surface::cardboard, Surface::panel, Surface::wood, Surface::metal,
                               Surface::cloth, Surface::poster, Surface::picture});
    add_box(world_.facets, {centre, Vec3(a, b, c), about_z(angle)}, what, tint(), std::max(0.4, 2 * std::max({a, b, c})));
    z += 2 * c;
  }
  return true;
}

/// Thin rods that cross one another, as in plants, tripods and stacked chairs: what is seen between them changes with
/// every step.
bool RoomPopulator::add_tangle(const Vec3& floor_point) {
  const double height = rng_.uniform(0.5, 1.7), foot = rng_.uniform(0.05, 0.2), crown = rng_.uniform(0.15, 0.45);
  for (double z = 0; z < height; z += 0.3)
    if (!is_clear(floor_point + Vec3(0, 0, z), crown)) return false;
  const auto within = [&](double radius, double z) {
    const double angle = rng_.uniform(0, 2 * std::numbers::pi), r = radius * std::sqrt(rng_.uniform());
    return Vec3(floor_point + Vec3(r * std::cos(angle), r * std::sin(angle), z));
  };
  const int what = plain_or({Surface::metal, Surface::wood, Surface::cloth});
  for (int i = 10 + static_cast<int>(rng_.below(10)); i > 0; --i) {
    const double low = rng_.uniform(0, 0.6) * height, high = rng_.uniform(0.7, 1.0) * height, thick = rng_.uniform(0.006, 0.02);
    const Vec3 from = within(foot + (crown - foot) * low / height, low), to = within(crown, high);
    const Quat q = so3_between(Vec3::UnitZ(), to - from);
    add_box(world_.facets, {0.5 * (from + to), Vec3(thick, thick, 0.5 * (to - from).norm()), q}, what, tint(), 0.5);
  }
  return true;
}

bool RoomPopulator::add_pillar(const Vec3& floor_point) {
  const double h = 0.5 * world_.plan.height_m;
  for (double z = 0; z < 2 * h; z += 0.4)
    if (!is_clear(floor_point + Vec3(0, 0, z), 0.25)) return false;
  add_box(world_.facets, {floor_point + Vec3(0, 0, h), Vec3(0.17, 0.17, h), Quat::Identity()},
          1 + kVariants * static_cast<int>(Surface::concrete), 1.0f, 1.2);
  return true;
}

/// Pipes and ducts along a wall under the ceiling, and a vertical one.
void RoomPopulator::add_pipes(const Wall& wall) {
  const Vec3 x = wall.along.normalized(), foot(wall.corner.x(), wall.corner.y(), 0);
  const Quat q = about_z(std::atan2(x.y(), x.x()));
  const int what = plain_or({Surface::metal, Surface::wood});
  double z = world_.plan.height_m - 0.1;
  for (int i = 1 + static_cast<int>(rng_.below(3)); i > 0; --i) {
    const double r = rng_.uniform(0.015, 0.07);
    z -= 2.2 * r;
    const Vec3 centre = foot + 0.5 * wall.along + Vec3(0, 0, z) + (r + 0.04) * wall.inward();
    if (is_clear(Vec3(centre.x(), centre.y(), z), 0.0))
      add_box(world_.facets, {centre, Vec3(0.5 * wall.length(), r, r), q}, what, tint(), 0.6);
  }
  const double r = rng_.uniform(0.02, 0.06), at = rng_.uniform(0.1, 0.9);
  add_box(world_.facets,
          {foot + at * wall.along + Vec3(0, 0, 0.5 * world_.plan.height_m) + (r + 0.03) * wall.inward(),
           Vec3(r, r, 0.5 * world_.plan.height_m), q},
          what, tint(), 0.6);
}

}  // namespace fbvins
