// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/flight_join.hpp"

#include <gtest/gtest.h>

#include <map>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace flight_join_test {

using namespace test_room;

/// In the file, where words are not kept.
PlaceMap filed(const PlaceMap& map) {
  const std::string bytes = serialise_map(map);
  return *parse_map(std::as_bytes(std::span(bytes)), "a map");
}

void fly(LoopCloser& closer, const std::vector<Frame>& frames, double scale = 1, std::uint32_t reset_counter = 0) {
  for (const Frame& f : frames)
    closer.process(f.place, keyframe(FrameId{f.t.ns}, f.t, {f.odometry.q, scale * f.odometry.p}, reset_counter));
}

const PlaceMap& monday() {
  static const PlaceMap map = [] {
    LoopCloser closer(rig(), {}, vocabulary());
    fly(closer, flight(room(1), 100, 0.001, 0.01, 2));
    closer.finish();
    return filed(closer.map());
  }();
  return map;
}

TEST(FlightJoin, AGoodFlightJoinsAndIsRemembered) {
  LoopCloser closer(rig(), {}, vocabulary(), monday());
  fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3));
  closer.finish();
  EXPECT_TRUE(closer.objections().empty()) << closer.objections().begin()->second;
  EXPECT_FALSE(closer.reduced());
  const PlaceMap both = filed(closer.map());
  ASSERT_EQ(both.sessions.size(), 2u);
  EXPECT_EQ(both.sessions[1].number, 1u);
  EXPECT_EQ(both.sessions[1].keyframes, 60);
  EXPECT_GT(both.sessions[1].loops, 30);
  EXPECT_EQ((both.sessions[1].ended - both.sessions[1].began).seconds(), 0.2 * 59);
  EXPECT_LT(both.size(), monday().size() + 40) << "what brings nothing new is left out";
  EXPECT_EQ(serialise_map(filed(both)), serialise_map(both));
}

TEST(FlightJoin, AFlightOfWrongScaleLeavesTheMapAsItWasToTheByte) {
  LoopCloser closer(rig(), {}, vocabulary(), monday());
  fly(closer, flight(room(1), 80, 0.001, 0.01, 9, 7.3), 1.25);
  closer.finish();
  ASSERT_EQ(closer.objections().count(1), 1u);
  ASSERT_TRUE(closer.reduced());
  EXPECT_EQ(serialise_map(*closer.reduced()), serialise_map(monday()));
  EXPECT_GT(closer.map().size(), monday().size()) << "the flight itself keeps what it saw";
}

TEST(FlightJoin, AFlightThatNeverFindsItselfLeavesTheMapAsItWasToTheByte) {
  PlaceMap map = monday();
  map.keyframes()[5].T_MB.p.x() += 0.01;  // as in a part that was cut out, the graph would move it
  map = filed(map);
  LoopCloser closer(rig(), {}, vocabulary(), map);
  fly(closer, flight(room(7), 60, 0.001, 0.01, 9, 7.3));
  closer.finish();
  EXPECT_TRUE(closer.corrected({}).empty());
  EXPECT_EQ(serialise_map(closer.map()), serialise_map(map));
}

TEST(FlightJoin, OfAFlightWithARestartOnlyTheGoodPartJoins) {
  LoopCloser closer(rig(), {}, vocabulary(), monday());
  fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3));
  fly(closer, flight(room(1), 60, 0.001, 0.01, 11, 40), 1.25, 1);
  EXPECT_EQ(closer.objections().count(1), 0u);
  EXPECT_EQ(closer.objections().count(2), 1u) << "also before the end";
  closer.finish();
  ASSERT_TRUE(closer.reduced());
  const PlaceMap kept = filed(*closer.reduced());
  ASSERT_EQ(kept.sessions.size(), 2u);
  std::map<std::int64_t, Vec3> flown;
  for (const MapKeyframe& k : closer.map().keyframes()) flown[k.t.ns] = k.T_MB.p;
  int old = 0, of_good_part = 0;
  for (const MapKeyframe& k : kept.keyframes()) {
    const MapKeyframe* before = monday().find(k.id);
    ++(before ? old : of_good_part);
    if (before) {
      EXPECT_EQ(k.T_MB.p, before->T_MB.p) << "what was there stays";
    } else {
      EXPECT_LT((k.T_MB.p - flown[k.t.ns]).norm(), 0.03);
    }
  }
  EXPECT_GT(old, 50);
  EXPECT_GT(of_good_part, 0);
}

TEST(FlightJoin, AFullMapKeepsItsOldKeyframesUntilTheFlightIsJudged) {
  LoopOptions options;
  options.thin_above = 10;
  options.max_keyframes = static_cast<int>(monday().size());
  LoopCloser closer(rig(), options, vocabulary(), monday());
  fly(closer, flight(room(1), 60, 0.001, 0.01, 9, 7.3));
  for (const MapKeyframe& k : monday().keyframes()) EXPECT_NE(closer.map().find(k.id), nullptr);
  EXPECT_LE(closer.map().size(), monday().size() * 6 / 5 + 1);
  closer.finish();
  EXPECT_LE(closer.map().size(), monday().size());
}

}  // namespace flight_join_test
}  // namespace fbvins
