// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_upkeep.hpp"

#include <gtest/gtest.h>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace map_upkeep_test {

using namespace test_room;

/// Adds a session with keyframes at `count` poses of the rounds, `step_s` apart, as they look in `world`.
void add_session(PlaceMap& map, const World& world, std::uint32_t session, int count, double step_s, Rng& rng) {
  map.cameras[0] = rig().T_BC0();
  for (int i = 0; i < count; ++i) {
    const Pose<G, B> T = true_pose(step_s * i);
    MapKeyframe k;
    k.session = session;
    k.t = Time{} + Duration::from_seconds(1000.0 * session + step_s * i);
    k.T_GB = T;
    k.T_MB = {T.q, T.p};
    k.place = seen(world, T, rng);
    map.add(std::move(k));
  }
}

std::vector<std::uint32_t> sessions_left(PlaceMap& map, const std::vector<KeyframeId>& gone) {
  for (const KeyframeId id : gone) map.remove(id);
  std::vector<std::uint32_t> left;
  for (const MapKeyframe& k : map.keyframes()) left.push_back(k.session);
  return left;
}

TEST(MapUpkeep, WhatLooksTheSameFromTheSamePlaceBringsNothing) {
  Rng rng(1);
  PlaceMap map;
  PlaceVerifier verifier({});
  add_session(map, room(1), 0, 12, 0.3, rng);
  add_session(map, room(1), 1, 12, 0.3, rng);
  const std::vector<KeyframeId> gone = what_leaves(map, {1}, verifier);
  EXPECT_GE(gone.size(), 8u);
  EXPECT_LT(gone.size(), 12u) << "some stay, whose loops tie the old ones";
  for (const KeyframeId id : gone) EXPECT_EQ(map.find(id)->session, 1u);
  for (const MapKeyframe& k : map.keyframes()) EXPECT_EQ(k.missed, 0);
}

TEST(MapUpkeep, ViewsOfOtherLightAreAddedAndWhatIsNeverKnownAgainLeaves) {
  Rng rng(1);
  PlaceMap map;
  PlaceVerifier verifier({});
  add_session(map, room(1), 0, 6, 3, rng);  // far from one another
  add_session(map, room(2), 1, 6, 3, rng);  // the same poses, and nothing looks as it did
  EXPECT_TRUE(what_leaves(map, {1}, verifier).empty());
  for (int i = 0; i < 6; ++i) EXPECT_EQ(map.keyframes()[static_cast<std::size_t>(i)].missed, 1);
  // Days in the new light: the old keyframes leave after five, but for the first, which defines M.
  std::vector<std::uint32_t> left;
  for (std::uint32_t day = 2; day < 6; ++day) {
    EXPECT_EQ(map.keyframes()[1].session, 0u) << day;
    add_session(map, room(2), day, 6, 3, rng);
    left = sessions_left(map, what_leaves(map, {day}, verifier));
  }
  EXPECT_EQ(std::count(left.begin(), left.end(), 0u), 1);
  EXPECT_EQ(std::count(left.begin(), left.end(), 1u), 6) << "known again every day";
}

TEST(MapUpkeep, ASpotHasNoMoreThanFourViews) {
  Rng rng(1);
  PlaceMap map;
  PlaceVerifier verifier({});
  add_session(map, room(1), 0, 3, 3, rng);
  for (std::uint32_t look = 1; look < 12; ++look) {
    add_session(map, room(100 + look), look, 3, 3, rng);
    sessions_left(map, what_leaves(map, {look}, verifier));
    EXPECT_LE(map.size(), 3 * 4 + 1u) << "the first keyframe of all stays";
  }
  EXPECT_EQ(map.keyframes().back().session, 11u);
}

TEST(MapUpkeep, AMapThatIsFlownInDailyStaysBounded) {
  PlaceMap map;
  std::vector<std::size_t> sizes;
  for (std::uint32_t day = 0; day < 6; ++day) {
    LoopCloser closer(rig(), {}, vocabulary(), map);
    for (const Frame& f : flight(room(1), 60, 0.001, 0.01, 20 + day, 3.1 * day))
      closer.process(f.place, keyframe(FrameId{f.t.ns}, f.t, f.odometry));
    closer.finish();
    EXPECT_TRUE(closer.objections().empty()) << day;
    const std::string bytes = serialise_map(closer.map());
    map = *parse_map(std::as_bytes(std::span(bytes)), "a map");
    sizes.push_back(map.size());
  }
  EXPECT_EQ(sizes[0], 60u);
  EXPECT_LT(sizes[5], 3 * sizes[0]);
  EXPECT_LT(sizes[5] - sizes[4], 30u);
  EXPECT_EQ(map.sessions.size(), 6u);
}

}  // namespace map_upkeep_test
}  // namespace fbvins
