// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/failsafe.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace failsafe_test {

constexpr double kDt_s = 0.005;

FlightCondition good() { return {.health = {HealthState::good, HealthReason::none}, .estimate_age_s = 0.05}; }
FlightCondition with(HealthState state) { return {.health = {state, HealthReason::few_tracks}, .estimate_age_s = 0.05}; }

FlightMode after(Failsafe& failsafe, double seconds, FlightCondition seen) {
  for (double t = 0; t < seconds; t += kDt_s) failsafe.update(seen, kDt_s);
  return failsafe.mode();
}

Failsafe flying() {
  Failsafe failsafe;
  after(failsafe, 2, good());
  EXPECT_EQ(failsafe.mode(), FlightMode::mission);
  return failsafe;
}

TEST(Failsafe, DoesNotTakeOffWithoutAGoodPose) {
  Failsafe failsafe;
  EXPECT_EQ(after(failsafe, 10, with(HealthState::degraded)), FlightMode::waiting);
  EXPECT_EQ(after(failsafe, 25, with(HealthState::initialising)), FlightMode::landed);
  EXPECT_EQ(failsafe.reason(), FlightReason::no_pose);
}

TEST(Failsafe, HoldsWhileDegradedAndGoesOnAfterwards) {
  Failsafe failsafe = flying();
  EXPECT_EQ(after(failsafe, 0.1, with(HealthState::degraded)), FlightMode::mission);  // a single weak image is tolerated
  EXPECT_EQ(after(failsafe, 0.3, with(HealthState::degraded)), FlightMode::holding);
  EXPECT_EQ(failsafe.reason(), FlightReason::degraded);
  EXPECT_EQ(after(failsafe, 0.5, good()), FlightMode::holding);
  EXPECT_EQ(after(failsafe, 1.0, good()), FlightMode::mission);
  EXPECT_EQ(after(failsafe, 1.0, with(HealthState::degraded)), FlightMode::holding);
  EXPECT_EQ(after(failsafe, 16, with(HealthState::degraded)), FlightMode::landing);  // after the longest hold
}

TEST(Failsafe, SilenceHoldsAndThenDescends) {
  Failsafe failsafe = flying();
  FlightCondition seen = good();
  seen.estimate_age_s = 0.5;
  failsafe.update(seen, kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::holding);
  EXPECT_EQ(failsafe.reason(), FlightReason::late);
  seen.estimate_age_s = 2.5;
  failsafe.update(seen, kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::descending);
  EXPECT_EQ(failsafe.reason(), FlightReason::lost);
  seen.on_ground = true;
  failsafe.update(seen, kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::landed);
  EXPECT_EQ(failsafe.reason(), FlightReason::lost);
  EXPECT_EQ(after(failsafe, 5, good()), FlightMode::landed);  // no second take-off
}

TEST(Failsafe, LostDescendsAtOnceAndLandsByPosesWhenTheyReturn) {
  Failsafe failsafe = flying();
  failsafe.update(with(HealthState::lost), kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::descending);
  EXPECT_EQ(after(failsafe, 1.2, good()), FlightMode::landing);
  EXPECT_EQ(failsafe.reason(), FlightReason::lost);
}

TEST(Failsafe, LeavingTheFenceOrThePathEndsTheMission) {
  FlightCondition seen = good();
  seen.outside_fence = true;
  Failsafe fenced = flying();
  fenced.update(seen, kDt_s);
  EXPECT_EQ(fenced.mode(), FlightMode::landing);
  EXPECT_EQ(fenced.reason(), FlightReason::outside_fence);
  Failsafe adrift = flying();
  seen = good();
  seen.off_path_m = 1.5;
  EXPECT_EQ(after(adrift, 1, seen), FlightMode::landing);
  EXPECT_EQ(adrift.reason(), FlightReason::off_path);
}

TEST(Failsafe, ARestartHolds) {
  Failsafe failsafe = flying();
  FlightCondition seen = good();
  seen.restarted = true;
  failsafe.update(seen, kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::holding);
  EXPECT_EQ(after(failsafe, 1.5, good()), FlightMode::mission);
}

TEST(Failsafe, LandsByPlan) {
  Failsafe failsafe = flying();
  FlightCondition seen = good();
  seen.landing = true;
  failsafe.update(seen, kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::landing);
  seen.on_ground = true;
  failsafe.update(seen, kDt_s);
  EXPECT_EQ(failsafe.mode(), FlightMode::landed);
  EXPECT_EQ(failsafe.reason(), FlightReason::none);
}

}  // namespace failsafe_test
}  // namespace fbvins
