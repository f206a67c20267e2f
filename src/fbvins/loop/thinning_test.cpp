// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/thinning.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace thinning_test {

/// Keyframes along a line, `gap_m` apart, of the sessions given.
PlaceMap line(const std::vector<std::uint32_t>& sessions, double gap_m = 1) {
  PlaceMap map;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    MapKeyframe k;
    k.session = sessions[i];
    k.T_MB.p.x() = gap_m * static_cast<double>(i);
    map.add(std::move(k));
  }
  return map;
}

MapEdge loop_of(double metres) {
  return {KeyframeId{0}, KeyframeId{1}, {Quat::Identity(), Vec3(metres, 0, 0)}, Mat6::Identity()};
}

TEST(Thinning, NothingGoesWhileThereIsRoom) {
  const PlaceMap map = line(std::vector<std::uint32_t>(40, 0));
  Thinning thinning(40, 100);
  thinning.note(KeyframeId{3}, std::vector{loop_of(0.01)}, 3);
  EXPECT_FALSE(thinning.next(map));
}

TEST(Thinning, RedundantOnesGoFirstInOrderAndNeverTheNewest) {
  const PlaceMap map = line(std::vector<std::uint32_t>(40, 0));
  Thinning thinning(30, 100);
  thinning.note(KeyframeId{3}, std::vector{loop_of(5), loop_of(0.1)}, 3);
  thinning.note(KeyframeId{4}, std::vector{loop_of(5)}, 4);
  thinning.note(KeyframeId{9}, std::vector{loop_of(0.1)}, 9);
  thinning.note(KeyframeId{30}, std::vector{loop_of(0.1)}, 30);
  EXPECT_EQ(thinning.next(map), KeyframeId{3});
  EXPECT_EQ(thinning.next(map), KeyframeId{9});
  EXPECT_FALSE(thinning.next(map));
}

TEST(Thinning, TheFullerTheMapTheLessIsNew) {
  Thinning thinning(30, 100);
  thinning.note(KeyframeId{3}, std::vector{loop_of(0.35)}, 30);
  const PlaceMap map = line(std::vector<std::uint32_t>(40, 0));
  EXPECT_FALSE(thinning.next(map));
  thinning.note(KeyframeId{4}, std::vector{loop_of(0.35)}, 60);
  EXPECT_EQ(thinning.next(map), KeyframeId{4});
}

TEST(Thinning, AboveTheLimitTheOneBetweenTheNearestNeighboursGoes) {
  PlaceMap map = line(std::vector<std::uint32_t>(40, 0));
  map.keyframes()[7].T_MB.p.x() = 5.5;  // 6 lies between 5 and 5.5
  Thinning thinning(1000, 39);
  EXPECT_EQ(thinning.next(map), KeyframeId{6});
  EXPECT_FALSE(Thinning(1000, 40).next(map));
}

TEST(Thinning, EndsWithAMapOfTwo) {
  PlaceMap map = line({0, 1, 2, 3, 4});
  Thinning thinning(1, 1);
  int steps = 0;
  for (; steps < 10; ++steps) {
    const auto id = thinning.next(map);
    if (!id) break;
    EXPECT_NE(*id, KeyframeId{0}) << "the first keyframe defines M";
    map.remove(*id);
  }
  EXPECT_EQ(steps, 3);
}

TEST(Thinning, HeirsAreOfTheSessionElseTheLastOneWithAPlace) {
  PlaceMap map = line({0, 0, 1, 1, 2, 3});
  const auto successor = [&](std::size_t i) { return successor_of(map, map.keyframes()[i]); };
  EXPECT_EQ(successor(1)->id, KeyframeId{0});
  EXPECT_EQ(successor(2)->id, KeyframeId{3}) << "of its own session";
  EXPECT_EQ(successor(4)->id, KeyframeId{3}) << "alone in its session";
  map.keyframes()[3].placed = false;
  EXPECT_EQ(successor(4)->id, KeyframeId{2});
  map.keyframes()[4].placed = false;
  EXPECT_EQ(successor(4), nullptr) << "nothing joins it to M";
}

}  // namespace thinning_test
}  // namespace fbvins
