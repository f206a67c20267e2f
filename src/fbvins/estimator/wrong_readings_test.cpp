// SPDX-License-Identifier: Apache-2.0
// The whole estimator on simulated tracks, with a gyroscope that goes wrong slowly, and after a restart that this has caused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/estimated_flight.hpp"

namespace fbvins {
namespace wrong_readings_test {

using test::EstimatedFlight;
using test::Motion;
using test::SimulatedFlight;

constexpr int kFrom = 100, kTo = 145, kEnd = 260;
/// Images that end as long after the drift has begun, and begin again after its end.
constexpr int kDark = 25, kSeenAgain = 60;

/// Errors are those in the newest W.
struct Flown : EstimatedFlight {
  std::vector<double> error_m;  ///< of each frame; 0 without a pose
};

/// The gyroscope drifts from kFrom on, and is right again from kTo on.
Flown fly_with_drift(const Vec3& drift_radps2, bool dark) {
  SimulatedFlight flight(Motion(0.7, 0.25), 1);
  flight.images = [dark](int k) { return !dark || k < kFrom + kDark || k >= kFrom + kSeenAgain; };
  Estimator estimator(flight.rig, EstimatorOptions{});
  const Vec3 bias = flight.bias.gyro_radps;
  Flown out;
  std::uint32_t of_W = 0;
  for (int k = 0; k < kEnd; ++k) {
    const bool wrong = k >= kFrom && k < kTo;
    flight.bias.gyro_radps = bias + (wrong ? Vec3((k - kFrom) / flight.image_rate_hz * drift_radps2) : Vec3::Zero());
    out.odometry.push_back(estimator.process(flight.frame(k)).odometry);
    out.truth.push_back(flight.truth(k));
    const Odometry& newest = out.odometry.back();
    const bool posed = newest.health.has_pose();
    if (posed && (out.gauge_frame < 0 || newest.reset_counter != of_W))
      out.gauge_frame = k, out.gauge_pose = newest.T_WB, of_W = newest.reset_counter;
    out.error_m.push_back(posed ? out.position_error(k) : 0);
  }
  return out;
}

TEST(WrongReadings, AGyroscopeThatDriftsIsSeenBeforeItHasMovedThePoseFar) {
  const Flown flown = fly_with_drift(Vec3(0, 0.02, 0), false);
  int seen = kFrom;
  while (seen < kTo && flown.odometry[seen].health.reason != HealthReason::contradiction) ++seen;
  EXPECT_LT(seen, kTo);
  EXPECT_LT(flown.error_m[seen], 0.06);
  for (int k = kFrom; k < kEnd; ++k) {
    const Odometry& o = flown.odometry[k];
    EXPECT_LT(flown.error_m[k], 3 * std::sqrt(o.pose_covariance.topLeftCorner<3, 3>().trace())) << k;
  }
  EXPECT_EQ(flown.odometry.back().health.state, HealthState::good);
  EXPECT_EQ(flown.odometry.back().reset_counter, flown.odometry[kFrom].reset_counter + 1)
      << "the pose has moved by an unknown amount";
}

/// A start may be as wrong as what ended the window before.
TEST(WrongReadings, AfterARestartInAContradictionImagesAndReadingsHaveToAgreeForASecond) {
  const Flown flown = fly_with_drift(Vec3(-0.03, 0, 0), true);
  const auto is = [](HealthState state) { return [state](const Odometry& o) { return o.health.state == state; }; };
  const auto lost = std::find_if(flown.odometry.begin(), flown.odometry.end(), is(HealthState::lost));
  ASSERT_NE(lost, flown.odometry.end());
  EXPECT_EQ(lost->health.reason, HealthReason::contradiction);
  const auto started = std::find_if(lost + 1, flown.odometry.end(), [](const Odometry& o) { return o.health.has_pose(); });
  const auto good = std::find_if(started, flown.odometry.end(), is(HealthState::good));
  ASSERT_NE(good, flown.odometry.end());
  EXPECT_EQ(started->health, (Health{HealthState::degraded, HealthReason::contradiction}));
  EXPECT_GE((good->t - started->t).seconds(), 0.99);
}

}  // namespace wrong_readings_test
}  // namespace fbvins
