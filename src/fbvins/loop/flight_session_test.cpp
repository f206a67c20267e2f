// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/flight_session.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_room.hpp"

namespace fbvins {
namespace flight_session_test {

Keyframe at(double x_m, double s, std::uint32_t reset_counter = 0) {
  return test_room::keyframe(FrameId{1}, Time{} + Duration::from_seconds(s), {Quat::Identity(), Vec3(x_m, 0, 0)}, reset_counter);
}

TEST(FlightSession, HasTheKeyframesOfOneGauge) {
  EXPECT_FALSE(FlightSession().has(at(0, 0)));
  const FlightSession session(at(0, 0, 3), 7, true, {}, 2);
  EXPECT_TRUE(session.has(at(1, 1, 3)));
  EXPECT_FALSE(session.has(at(1, 1, 4)));
  EXPECT_EQ(session.number(), 7u);
}

TEST(FlightSession, CountsTheWayFromItsFirstKeyframeOn) {
  FlightSession session(at(5, 0), 0, true, {}, 1);
  for (const double x_m : {5.0, 6.0, 5.5}) session.advance(at(x_m, x_m), std::nullopt);
  EXPECT_DOUBLE_EQ(session.path_m(), 1.5);
  EXPECT_EQ(session.gauge().T_GB.p.x(), 5.5);
}

TEST(FlightSession, KnowsTheNewestOfEachCamera) {
  FlightSession session(at(0, 0), 0, true, {}, 2);
  EXPECT_FALSE(session.newest().valid());
  session.added(KeyframeId{4}, 0);
  session.added(KeyframeId{5}, 1);
  EXPECT_EQ(session.newest(), KeyframeId{5});
  EXPECT_EQ(session.newest_of(0), KeyframeId{4});
  EXPECT_EQ(session.newest_of(1), KeyframeId{5});
}

TEST(FlightSession, IsLevelByWhatItWasToldLast) {
  FlightSession session(at(0, 0), 0, true, {}, 1);
  EXPECT_TRUE(session.is_level());
  session.take_level({so3_exp(Vec3(0.01, 0, 0)), 0.002});
  EXPECT_FALSE(session.is_level());
  EXPECT_EQ(session.up_sigma_rad(), 0.002);
  session.level_by_newest();
  EXPECT_TRUE(session.is_level());
  EXPECT_EQ(session.q_LG().coeffs(), so3_exp(Vec3(0.01, 0, 0)).coeffs());
}

TEST(FlightSession, IsFoundInAnOlderMapEachTimeThatItBecomesLocalised) {
  FlightSession older(at(0, 0), 1, false, {}, 1), first(at(0, 0), 0, true, {}, 1);
  EXPECT_TRUE(older.note_localised(true));
  EXPECT_FALSE(older.note_localised(true));
  EXPECT_FALSE(older.note_localised(false));
  EXPECT_TRUE(older.note_localised(true));
  EXPECT_FALSE(first.note_localised(true)) << "it began the map";
}

TEST(FlightSession, OnlyOneCameraInAnotherFlightsMapNeedsAScale) {
  Keyframe k = at(0, 0);
  k.scale_sigma = 0.02;
  FlightSession older(k, 1, false, {}, 1), first(k, 0, true, {}, 1);
  EXPECT_FALSE(older.needs_scale()) << "nothing is known of it yet";
  older.advance(k, std::nullopt), first.advance(k, std::nullopt);
  EXPECT_TRUE(older.needs_scale());
  EXPECT_FALSE(first.needs_scale()) << "its lengths are the map's";
  EXPECT_DOUBLE_EQ(older.scale_sigma(), 0.02);
}

}  // namespace flight_session_test
}  // namespace fbvins
