// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/collision.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace collision_test {

World world_with(const std::vector<Facet>& facets) {
  World world;
  world.facets = facets;
  return world;
}

Facet facet(const Vec3& corner, const Vec3& u, const Vec3& v) {
  Facet f;
  f.corner = corner;
  f.u = u;
  f.v = v;
  return f;
}

TEST(NearestPoint, InsideOnEdgesAndAtCorners) {
  const Vec3 c(0, 0, 0), u(2, 0, 0), v(1, 1, 0);  // not a rectangle
  EXPECT_LT((nearest_point(c, u, v, {1.5, 0.5, 3}) - Vec3(1.5, 0.5, 0)).norm(), 1e-12);
  EXPECT_LT((nearest_point(c, u, v, {1, -2, 0}) - Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((nearest_point(c, u, v, {5, 3, 1}) - Vec3(3, 1, 0)).norm(), 1e-12);
  EXPECT_LT((nearest_point(c, u, v, {-1, -1, 0}) - c).norm(), 1e-12);
}

TEST(Collision, WallsStopADiscAtItsRim) {
  const World world = world_with({facet({1, -5, 0}, {0, 10, 0}, {0, 0, 3})});
  const CollisionCheck check(world, {.radius_m = 0.3, .half_height_m = 0.1});
  EXPECT_FALSE(check.touched_at({0.65, 0, 1}));
  ASSERT_TRUE(check.touched_at({0.75, 0, 1}));
  EXPECT_NEAR(check.touched_at({0.75, 0, 1})->x(), 1, 1e-12);
  EXPECT_FALSE(check.touched_at({0.75, 0, 3.2}));
}

TEST(Collision, TheHullIsFlat) {
  const World world = world_with({facet({-1, -1, 0.5}, {2, 0, 0}, {0, 2, 0})});  // a table
  const CollisionCheck check(world, {.radius_m = 0.3, .half_height_m = 0.1});
  EXPECT_FALSE(check.touched_at({0, 0, 0.65}));
  EXPECT_TRUE(check.touched_at({0, 0, 0.58}));
}

TEST(Collision, TheFloorDoesNotCount) {
  const World world = world_with({facet({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}), facet({0, 0, 0.004}, {1, 0, 0}, {0, 1, 0})});
  const CollisionCheck check(world, {});
  EXPECT_FALSE(check.touched_at({0.2, 0.2, 0.05}));
}

}  // namespace collision_test
}  // namespace fbvins
