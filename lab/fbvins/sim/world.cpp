// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/world.hpp"

#include <cmath>
#include <numbers>

#include "fbvins/sim/populate_room.hpp"

namespace fbvins {

Vec3 Mover::position(double t_s) const {
  const double share = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * t_s / round_trip_s + phase_rad);
  return from + share * (to - from);
}

Quat Mover::rotation(double t_s) const { return so3_exp(Vec3(0, 0, spin_radps * t_s + phase_rad)); }

World build_world(const WorldOptions& options, const FloorPlan& plan, const std::vector<Vec3>& path, std::uint64_t seed) {
  World world;
  world.plan = plan;
  paint_all(world, seed);
  RoomPopulator furnisher(world, options, path, seed);
  furnisher.build_shell();
  furnisher.hang_pictures();
  furnisher.cover_floors();
  furnisher.place_furniture();
  furnisher.hang_lamps();
  furnisher.add_movers();
  for (Facet& facet : world.facets) facet.detail = static_cast<float>(options.detail);
  return world;
}

void append_movers(const World& world, double t_s, const Vec3& camera, std::vector<Facet>& facets) {
  for (const Mover& mover : world.movers) {
    const Vec3 p = mover.position(t_s);
    if (Vec2(camera.x() - p.x(), camera.y() - p.y()).norm() < mover.radius_m + 0.35) continue;
    const Mat3 R = mover.rotation(t_s).toRotationMatrix();
    for (Facet f : mover.facets) {
      f.corner = R * f.corner + p;
      f.u = R * f.u;
      f.v = R * f.v;
      facets.push_back(f);
    }
  }
}

}  // namespace fbvins
