// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/room_changes.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/sim/populate_room.hpp"

namespace fbvins {
namespace room_changes_test {

/// An empty room of 8 x 6 m with one facet of its own, ten boxes and two ceiling lamps, one of each group.
World room_with_boxes() {
  World world;
  world.plan.rooms = {{-4, -3, 4, 3}};
  world.facets.push_back({.corner = Vec3(-4, -3, 0), .u = Vec3(8, 0, 0), .v = Vec3(0, 6, 0)});
  for (int i = 0; i < 10; ++i) {
    const std::size_t first = world.facets.size();
    add_box(world.facets, {Vec3(0.7 * i - 3.2, 2.4, 0.2), Vec3(0.2, 0.2, 0.2), Quat::Identity()}, 0, 1, 1);
    world.furniture.push_back({first, world.facets.size() - first});
  }
  for (const int group : {kLampsA, kLampsB}) {
    world.lamps.push_back({Vec3(group, 0, 2.9), 5, group});
    world.facets.push_back({.corner = Vec3(group, 0, 2.9), .emission = 2, .lamp_group = group});
  }
  return world;
}

const std::vector<Vec3> kPath = {Vec3(-2, 0, 1), Vec3(0, 0, 0.4), Vec3(2, 0, 1)};

int moved_pieces(const World& before, const World& after) {
  int moved = 0;
  for (std::size_t i = 0; i < before.furniture.size(); ++i)
    moved += before.facets[before.furniture[i].first].corner != after.facets[after.furniture[i].first].corner;
  return moved;
}

TEST(RoomChanges, ThatShareOfTheFurnitureStandsElsewhereAndNothingElseMoves) {
  const World before = room_with_boxes();
  for (const double share : {0.0, 0.3, 1.0}) {
    World after = before;
    Rng rng(3);
    move_furniture(after, share, kPath, rng);
    ASSERT_EQ(after.furniture.size(), before.furniture.size());
    EXPECT_EQ(moved_pieces(before, after), std::lround(10 * share));
    EXPECT_EQ(after.facets.front().corner, before.facets.front().corner);
    EXPECT_EQ(after.facets.back().corner, before.facets.back().corner);
    for (std::size_t i = 0; i < after.facets.size(); ++i)
      EXPECT_NEAR(after.facets[i].u.cross(after.facets[i].v).norm(), before.facets[i].u.cross(before.facets[i].v).norm(), 1e-9);
    for (const Vec3& p : kPath) EXPECT_TRUE(has_room_for_camera(after, p));
  }
}

TEST(RoomChanges, APieceForWhichThereIsNoRoomLeaves) {
  World world = room_with_boxes();
  std::vector<Vec3> everywhere;
  for (double x = -4; x <= 4; x += 0.5)
    for (double y = -3; y <= 3; y += 0.5) everywhere.emplace_back(x, y, 0.5);
  Rng rng(3);
  move_furniture(world, 0.5, everywhere, rng);
  ASSERT_EQ(world.furniture.size(), 5u);
  EXPECT_EQ(world.facets.size(), 1u + 5 * 6 + 2);
  for (const FurniturePiece& piece : world.furniture) EXPECT_NEAR(world.facets[piece.first].centre().y(), 2.4, 0.3);
}

TEST(RoomChanges, LampsThatAreOffNeitherGiveLightNorShine) {
  World half = room_with_boxes(), sun = half, standing = half;
  Rng rng(5);
  change_lamps(half, LampChange::half, rng);
  change_lamps(sun, LampChange::sun, rng);
  change_lamps(standing, LampChange::standing, rng);
  EXPECT_EQ(half.lamps.size(), 1u);
  EXPECT_EQ(half.facets.back().emission, 0);
  EXPECT_EQ(sun.lamps.size(), 1u);
  EXPECT_EQ(standing.lamps.size(), 2u);
  for (const World* world : {&sun, &standing}) {
    for (const Facet& f : world->facets) EXPECT_EQ(f.emission, 0);
    for (const Lamp& l : world->lamps) EXPECT_TRUE(world->plan.inside(l.p.x(), l.p.y()));
  }
}

TEST(RoomChanges, ACameraNeedsRoom) {
  const World world = room_with_boxes();
  EXPECT_TRUE(has_room_for_camera(world, Vec3(0, 0, 1)));
  EXPECT_FALSE(has_room_for_camera(world, Vec3(5, 0, 1)));
  EXPECT_FALSE(has_room_for_camera(world, Vec3(0, 0, 0.2)));
  EXPECT_FALSE(has_room_for_camera(world, Vec3(-3.2, 2, 0.4)));
}

}  // namespace room_changes_test
}  // namespace fbvins
