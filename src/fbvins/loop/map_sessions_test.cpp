// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_sessions.hpp"

#include <gtest/gtest.h>

#include "fbvins/loop/map_file.hpp"

namespace fbvins {
namespace map_sessions_test {

constexpr double kStep_m = 1;

/// Along x, `sessions` rounds of `keyframes` on the same way, each joined to the one before by loops of which session `bent` says
/// that it is 20 cm to the side.
PlaceMap rounds(int sessions, int keyframes, int bent = -1) {
  PlaceMap map;
  for (int s = 0; s < sessions; ++s)
    for (int i = 0; i < keyframes; ++i) {
      MapKeyframe k;
      k.session = static_cast<std::uint32_t>(s);
      k.t = Time{1'400'000'000'000'000'000 + 1'000'000'000LL * (3600 * s + i)};
      k.T_GB = {Quat::Identity(), Vec3(kStep_m * i, 0, 1)};
      k.T_MB = {Quat::Identity(), Vec3(kStep_m * i, 0, 1)};
      k.place.up_C0 = Vec3::UnitZ();
      const KeyframeId id = map.add(std::move(k));
      const auto join = [&](std::int64_t from, const Vec3& step, MapEdge::Kind kind) {
        map.edges.push_back({KeyframeId{from}, id, {Quat::Identity(), step}, 1e4 * Mat6::Identity(), kind});
      };
      if (i > 0) join(id.value - 1, Vec3(kStep_m, 0, 0), MapEdge::Kind::odometry);
      if (s > 0) join(id.value - keyframes, Vec3(0, s == bent && i > 0 ? 0.02 * i : 0, 0), MapEdge::Kind::loop);
    }
  return map;
}

TEST(MapSessions, ListsThemWithWhatTheirKeyframesShow) {
  PlaceMap map = rounds(3, 10);
  remember_sessions(map);
  map.remove(KeyframeId{12});
  const std::vector<SessionInMap> all = sessions_in(map);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[1].known.number, 1u);
  EXPECT_EQ(all[1].known.keyframes, 10);
  EXPECT_EQ(all[1].keyframes, 9);
  EXPECT_EQ(all[1].known.loops, 20);
  EXPECT_EQ(all[2].loops, 10);
  EXPECT_EQ((all[1].known.ended - all[1].known.began).seconds(), 9);
}

TEST(MapSessions, ASessionIsRolledBack) {
  PlaceMap map = rounds(3, 10, 2);
  const auto before = rounds(2, 10);
  map.optimise({});
  EXPECT_GT(std::abs(map.keyframes()[9].T_MB.p.y()), 0.005) << "the bad session bends the others";
  const auto rest = without_sessions(map, {2});
  ASSERT_TRUE(rest) << rest.error().message;
  ASSERT_EQ(rest->size(), 20u);
  EXPECT_EQ(rest->sessions.size(), 2u);
  EXPECT_EQ(rest->edges.size(), before.edges.size());
  for (const MapKeyframe& k : rest->keyframes()) EXPECT_LT((k.T_MB.p - before.find(k.id)->T_MB.p).norm(), 1e-4);
}

TEST(MapSessions, WhatCannotBeRolledBackIsRefused) {
  EXPECT_EQ(without_sessions(rounds(2, 5), {7}).error().message, "there is no session 7 in the map");
  EXPECT_EQ(without_sessions(rounds(2, 5), {0, 1}).error().message, "none of its 10 keyframes would be left");
}

TEST(MapSessions, AreRememberedInTheFileThoughTheirKeyframesAreGone) {
  PlaceMap map = rounds(3, 4);
  remember_sessions(map);
  for (int i = 4; i < 8; ++i) map.remove(KeyframeId{i});
  map.keyframes()[2].missed = 3;
  const std::string bytes = serialise_map(map);
  const auto read = parse_map(std::as_bytes(std::span(bytes)), "a map");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->sessions.size(), 3u);
  EXPECT_EQ(read->sessions[1].keyframes, 4);
  EXPECT_EQ(read->keyframes()[2].missed, 3);
  EXPECT_EQ(serialise_map(*read), bytes);
  PlaceMap cut = map;
  cut.keyframes()[6].placed = cut.keyframes()[5].placed = cut.keyframes()[4].placed = cut.keyframes()[7].placed = false;
  const std::string without = serialise_map(cut);
  EXPECT_EQ(parse_map(std::as_bytes(std::span(without)), "a map")->sessions.size(), 2u) << "the last one has no place in M";
}

}  // namespace map_sessions_test
}  // namespace fbvins
