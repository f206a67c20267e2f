// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/collision.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Facets below this height (floor, mats, tapes) are ignored: the vehicle stands on them.
constexpr double kFloor_m = 0.08;

Vec3 nearest_on_edge(const Vec3& a, const Vec3& along, const Vec3& p) {
  const double s = along.squaredNorm() > 0 ? std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0) : 0.0;
  return a + s * along;
}

}  // namespace

Vec3 nearest_point(const Vec3& corner, const Vec3& u, const Vec3& v, const Vec3& p) {
  Mat2 gram;
  gram << u.dot(u), u.dot(v), u.dot(v), v.dot(v);
  const Vec3 d = p - corner;
  if (gram.determinant() > 1e-18) {
    const Vec2 s = gram.inverse() * Vec2(d.dot(u), d.dot(v));
    if (s.minCoeff() >= 0 && s.maxCoeff() <= 1) return corner + s.x() * u + s.y() * v;
  }
  Vec3 best = nearest_on_edge(corner, u, p);
  for (const Vec3& q : {nearest_on_edge(corner, v, p), nearest_on_edge(corner + u, v, p), nearest_on_edge(corner + v, u, p)})
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  return best;
}

CollisionCheck::CollisionCheck(const World& world, const VehicleHull& hull)
    : radius_(hull.radius_m), stretch_(hull.radius_m / hull.half_height_m) {
  const auto stretched = [&](const Vec3& x) { return Vec3(x.x(), x.y(), stretch_ * x.z()); };
  for (const Facet& f : world.facets) {
    const double highest = std::max({f.corner.z(), (f.corner + f.u).z(), (f.corner + f.v).z(), (f.corner + f.u + f.v).z()});
    if (highest < kFloor_m) continue;
    Plate plate{stretched(f.corner), stretched(f.u), stretched(f.v), stretched(f.centre()), 0};
    plate.reach = 0.5 * std::max((plate.u + plate.v).norm(), (plate.u - plate.v).norm());
    plates_.push_back(plate);
  }
}

std::optional<Vec3> CollisionCheck::touched_at(const Vec3& p_W) const {
  const Vec3 p(p_W.x(), p_W.y(), stretch_ * p_W.z());
  for (const Plate& plate : plates_) {
    if ((plate.centre - p).norm() > plate.reach + radius_) continue;
    const Vec3 q = nearest_point(plate.corner, plate.u, plate.v, p);
    if ((q - p).norm() < radius_) return Vec3(q.x(), q.y(), q.z() / stretch_);
  }
  return std::nullopt;
}

}  // namespace fbvins
