// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_turns.hpp"

#include <gtest/gtest.h>

#include "tests/support/imu_test_motion.hpp"

namespace fbvins {
namespace window_turns_test {

/// Eleven frames of a known motion, a tenth of a second apart, joined by readings of a gyroscope that is off by this.
FrameList frames(const Vec3& wrong_radps, double accuracy_scale = 1) {
  const test::Motion motion(0.4, 0.3);
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = 4e-4 * accuracy_scale;
  FrameList out;
  for (int k = 0; k <= 10; ++k) {
    Frame f;
    f.id = FrameId{k};
    f.t = Time{} + Duration::from_seconds(0.1 * k);
    f.state = motion.state<G>(f.t.seconds());
    if (k > 0) {
      Preintegration imu(noise, {});
      imu.integrate(
          motion.segment(f.t - Duration::from_seconds(0.1), f.t, Duration::from_seconds(0.005), {.gyro_radps = wrong_radps}));
      f.imu = std::make_shared<const Preintegration>(std::move(imu));
    }
    out.add(std::move(f));
  }
  return out;
}

TEST(WindowTurns, AreThoseOfRightReadings) {
  const WindowTurns turns = turns_of(frames(Vec3::Zero()));
  EXPECT_LT(turns.off_G.norm(), 1e-4);
  EXPECT_NEAR(turns.sigma_rad, 4e-4, 2e-5) << "a random walk over one second";
  EXPECT_NEAR(turns.span.seconds(), 1, 1e-9);
  EXPECT_GT(turns.turned_rad, 0.3);
}

TEST(WindowTurns, SayWhichRateIsWrong) {
  const FrameList all = frames(Vec3(0, 0, 0.02));
  Vec3 expected = Vec3::Zero();
  for (int j = 1; j < all.size(); ++j) expected -= all[j].state.T_FB.q * Vec3(0, 0, 0.002);
  EXPECT_LT((turns_of(all).off_G - expected).norm(), 0.02 * expected.norm());
}

TEST(WindowTurns, CountReadingsThatAreWorthLessLess) {
  EXPECT_NEAR(turns_of(frames(Vec3::Zero(), 7)).sigma_rad / turns_of(frames(Vec3::Zero())).sigma_rad, 7, 0.1);
}

TEST(WindowTurns, OfFramesWithoutReadingsAreNone) {
  FrameList all = frames(Vec3(0, 0, 0.02));
  for (int j = 0; j < all.size(); ++j) all[j].imu.reset();
  EXPECT_EQ(turns_of(all).sigma_rad, 0);
  EXPECT_EQ(turns_of(all).span.ns, 0);
}

}  // namespace window_turns_test
}  // namespace fbvins
