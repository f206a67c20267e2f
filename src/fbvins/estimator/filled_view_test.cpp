// SPDX-License-Identifier: Apache-2.0
// One thing fills the view of the whole estimator, and moves.
#include <gtest/gtest.h>

#include "tests/support/estimated_flight.hpp"

namespace fbvins {
namespace filled_view_test {

using test::EstimatedFlight;
using test::fly;
using test::Motion;
using test::SimulatedFlight;

constexpr int kFrom = 100, kTo = 160, kEnd = 260;

/// m/s, in the body's axes.
double velocity_error(const EstimatedFlight& flown, int k) {
  const Odometry& o = flown.odometry[static_cast<std::size_t>(k)];
  return (o.T_WB.q.conjugate() * o.v_WB - flown.truth[static_cast<std::size_t>(k)].v_B()).norm();
}

bool good(const EstimatedFlight& flown, int k) {
  return flown.odometry[static_cast<std::size_t>(k)].health.state == HealthState::good;
}

EstimatedFlight fly_past(const Vec3& velocity, int seed) {
  SimulatedFlight flight(Motion(0.5, 0.3), static_cast<std::uint64_t>(seed));
  flight.thing = [&](int k) {
    return k < kFrom || k >= kTo ? std::nullopt : std::optional<Vec3>((k - kFrom) / flight.image_rate_hz * velocity);
  };
  return fly(flight, kEnd);
}

TEST(FilledView, AThingThatMovesIsNotFollowedAsGood) {
  for (int seed = 1; seed <= 3; ++seed) {
    const EstimatedFlight flown = fly_past(Vec3(0, 1.5, 0), seed);
    for (int k = kFrom + 1; k < kEnd; ++k)
      if (good(flown, k)) {
        EXPECT_LT(velocity_error(flown, k), 0.3) << "seed " << seed << ", image " << k;
      }
    EXPECT_GT(velocity_error(flown, kTo - 1), 1) << seed;  // images alone cannot know
    EXPECT_GE(flown.odometry.back().reset_counter, 1u) << seed;
    EXPECT_TRUE(good(flown, kTo + 60)) << seed;  // gravity has confirmed the tilt
    EXPECT_TRUE(good(flown, kEnd - 1)) << seed;
  }
}

TEST(FilledView, TheCovarianceCoversHowFarThePoseHasMovedWithIt) {
  const EstimatedFlight flown = fly_past(Vec3(0, 1.5, 0), 4);
  for (int k = kFrom + 20; k < kTo; ++k) {
    const Odometry& o = flown.odometry[static_cast<std::size_t>(k)];
    if (!o.health.has_pose() || o.reset_counter > 0) continue;
    EXPECT_LT(flown.position_error(k), 3 * std::sqrt(o.pose_covariance.topLeftCorner<3, 3>().trace())) << k;
  }
}

TEST(FilledView, AThingThatStandsIsAsGoodAsTheRoom) {
  const EstimatedFlight flown = fly_past(Vec3::Zero(), 5);
  for (int k = kFrom; k < kEnd; ++k)
    if (k != kFrom && k != kTo) {  // the first images of other things, which have no earlier one to be compared with
      EXPECT_TRUE(good(flown, k)) << k;
    }
  EXPECT_EQ(flown.odometry.back().reset_counter, 0u);
}

}  // namespace filled_view_test
}  // namespace fbvins
