// SPDX-License-Identifier: Apache-2.0
// Whether the vehicle touches the world: walls, ceiling, furniture, but not the floor. Immutable, any thread.
//
//   CollisionCheck check(world, {.radius_m = 0.28, .half_height_m = 0.1});
//   if (std::optional<Vec3> place = check.touched_at(p_W)) crash(*place);
#pragma once

#include <optional>
#include <vector>

#include "fbvins/sim/world.hpp"

namespace fbvins {

/// An oblate ellipsoid that does not tilt with the vehicle.
struct VehicleHull {
  double radius_m = 0.28;
  double half_height_m = 0.12;
};

class CollisionCheck {
 public:
  CollisionCheck(const World& world, const VehicleHull& hull);

  /// The touched point in W of a hull with its centre at p_W, if any.
  std::optional<Vec3> touched_at(const Vec3& p_W) const;

 private:
  /// z is scaled such that the hull is a sphere.
  struct Plate {
    Vec3 corner, u, v, centre;
    double reach;
  };
  double radius_, stretch_;
  std::vector<Plate> plates_;
};

/// The point of the parallelogram corner + a u + b v, a and b in [0, 1], that is nearest to p.
Vec3 nearest_point(const Vec3& corner, const Vec3& u, const Vec3& v, const Vec3& p);

}  // namespace fbvins
