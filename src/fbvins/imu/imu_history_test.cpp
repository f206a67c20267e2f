// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_history.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace imu_history_test {

constexpr Time ms(double t) { return Time{static_cast<std::int64_t>(t * 1e6)}; }

/// A reading whose numbers are linear in time, so that interpolation is exact.
ImuSample ramp(double t_ms) { return {ms(t_ms), Vec3(t_ms, 2 * t_ms, 0) * 1e-3, Vec3(0, 0, 9 + t_ms * 1e-3)}; }

ImuHistory filled(int from_ms, int to_ms, Duration time_offset = {}) {
  ImuHistory history({}, time_offset);
  for (int t = from_ms; t <= to_ms; t += 5) history.add(ramp(t));
  return history;
}

TEST(ImuHistory, InterpolatesBothEnds) {
  const ImuSegment segment = filled(0, 100).between(ms(12), ms(33));
  ASSERT_EQ(segment.samples.size(), 6u);  // 12, 15, 20, 25, 30, 33
  EXPECT_EQ(segment.samples.front().t, ms(12));
  EXPECT_EQ(segment.samples.back().t, ms(33));
  EXPECT_NEAR(segment.samples.front().gyro_radps.x(), 0.012, 1e-12);
  EXPECT_NEAR(segment.samples.back().accel_mps2.z(), 9.033, 1e-12);
  EXPECT_EQ(segment.longest_gap.ns, 5'000'000);
}

TEST(ImuHistory, NeighbouringSegmentsShareTheirEnd) {
  const ImuHistory history = filled(0, 200);
  const ImuSegment a = history.between(ms(0), ms(51)), b = history.between(ms(51), ms(100));
  EXPECT_EQ(a.samples.back().t, b.samples.front().t);
  EXPECT_EQ(a.samples.back().gyro_radps, b.samples.front().gyro_radps);
  EXPECT_EQ(b.samples.back().t, ms(100));
  EXPECT_EQ(b.samples[b.samples.size() - 2].t, ms(95)) << "a reading on the stamp appears once";
}

TEST(ImuHistory, CoversAStampOnceAReadingAtOrAfterItIsHere) {
  ImuHistory history = filled(0, 48);
  EXPECT_FALSE(history.covers(ms(50)));
  history.add(ramp(50));
  EXPECT_TRUE(history.covers(ms(50)));
  EXPECT_TRUE(history.between(ms(50), ms(50)).empty()) << "an interval of no length has no segment";
}

TEST(ImuHistory, IsOnTheClockOfTheImages) {
  const ImuSegment segment = filled(0, 100, Duration::from_seconds(0.010)).between(ms(10), ms(50));
  EXPECT_EQ(segment.samples.front().t, ms(10));
  EXPECT_NEAR(segment.samples.front().gyro_radps.x(), 0.020, 1e-12) << "stamped 20 ms by the IMU";
  EXPECT_NEAR(segment.samples.back().gyro_radps.x(), 0.060, 1e-12);
}

/// Readings every `period_ms` until `to_ms`, of which `lacks` says which are missing.
template <class Lacks>
ImuHistory slow(int period_ms, int to_ms, const Lacks& lacks) {
  ImuHistory history;
  for (int t = 0; t <= to_ms; t += period_ms)
    if (!lacks(t)) history.add(ramp(t));
  return history;
}
constexpr auto kNothingLacks = [](int) { return false; };

/// Its own steps are interpolated in, and no gap of more than 50 ms; a reading that is missing is.
TEST(ImuHistory, TheStepsOfASlowImuAreNoGaps) {
  for (const int period_ms : {25, 50, 62, 100}) {
    const ImuHistory whole = slow(period_ms, 2000, kNothingLacks);
    const ImuSegment segment = whole.between(ms(1010), ms(1020));
    ASSERT_EQ(segment.samples.size(), 2u) << period_ms;
    EXPECT_NEAR(segment.samples.front().gyro_radps.x(), 1.010, 1e-12) << "interpolated";
    EXPECT_EQ(segment.longest_gap.ns, std::min(period_ms, 50) * 1'000'000);
    const int missing = 20 * period_ms;
    const ImuHistory broken = slow(period_ms, 3000, [&](int t) { return t == missing; });
    EXPECT_EQ(broken.between(ms(missing - 1), ms(missing + 1)).longest_gap.ns, 2 * period_ms * 1'000'000) << period_ms;
  }
}

TEST(ImuHistory, AFastImuThatBecomesSlowHasGaps) {
  ImuHistory history = filled(0, 1000);
  for (int t = 1050; t <= 4000; t += 50) history.add(ramp(t));
  EXPECT_EQ(history.between(ms(3940), ms(3990)).longest_gap.ns, 50'000'000) << "as long as it is";
  for (int t = 4060; t <= 8000; t += 60) history.add(ramp(t));
  EXPECT_EQ(history.between(ms(7900), ms(7960)).longest_gap.ns, 60'000'000);
  const ImuHistory too_slow = slow(120, 4000, kNothingLacks);
  EXPECT_EQ(too_slow.between(ms(3000), ms(3100)).longest_gap.ns, 120'000'000);
}

TEST(ImuHistory, HoldsTheNearestValueInAGapAndReportsIt) {
  ImuHistory history = filled(0, 40);
  for (int t = 140; t <= 200; t += 5) history.add(ramp(t));
  const ImuSegment a = history.between(ms(0), ms(60)), b = history.between(ms(60), ms(120)),
                   c = history.between(ms(120), ms(180));
  EXPECT_NEAR(a.samples.back().gyro_radps.x(), 0.040, 1e-12) << "40 ms is nearer to 60 than 140";
  EXPECT_NEAR(c.samples.front().gyro_radps.x(), 0.140, 1e-12);
  EXPECT_EQ(b.samples.size(), 2u);
  for (const ImuSegment& s : {a, b, c}) EXPECT_EQ(s.longest_gap.ns, 100'000'000);
  EXPECT_EQ(a.samples.back().gyro_radps, b.samples.front().gyro_radps);
}

TEST(ImuHistory, AStartBeforeTheFirstReadingIsHeldAndReported) {
  const ImuSegment segment = filled(100, 200).between(ms(50), ms(150));
  EXPECT_EQ(segment.samples.front().t, ms(50));
  EXPECT_NEAR(segment.samples.front().gyro_radps.x(), 0.1, 1e-12);
  EXPECT_EQ(segment.longest_gap.ns, 50'000'000);
}

TEST(ImuHistory, ASilentImuHasAGapThatGrows) {
  ImuHistory history = filled(0, 40);
  for (int image = 100; image <= 300; image += 50) {
    const ImuSegment segment = history.between(ms(image - 50), ms(image));
    EXPECT_EQ(segment.longest_gap.ns, (image - 40) * 1'000'000);
    ASSERT_FALSE(segment.empty()) << image;
    EXPECT_NEAR(segment.samples.back().gyro_radps.x(), 0.04, 1e-12);
    history.forget_before(ms(image));
  }
  for (int image = 350; image <= 2000; image += 50) {
    const ImuSegment segment = history.between(ms(image - 50), ms(image));
    EXPECT_TRUE(segment.empty()) << "a reading of " << image - 40 << " ms ago says nothing";
    EXPECT_EQ(segment.longest_gap.ns, (image - 40) * 1'000'000);
    history.forget_before(ms(image));
  }
  EXPECT_TRUE(ImuHistory().between(ms(0), ms(10)).empty());
}

TEST(ImuHistory, MemoryIsBounded) {
  ImuHistory history({}, {}, {.capacity = 100});
  for (int k = 0; k < 1000; ++k) history.add(ramp(5.0 * k));
  EXPECT_LE(history.size(), 100);
  EXPECT_EQ(history.size() + history.counts().overflow, 1000);
}

TEST(ImuHistory, ForgetsWhatNoLaterSegmentNeeds) {
  ImuHistory history = filled(0, 1000);
  history.forget_before(ms(902));
  EXPECT_EQ(history.size(), 21);  // 900 .. 1000
  EXPECT_FALSE(history.add(ramp(895))) << "stamps stay forward";
}

TEST(ImuHistory, CorrectsTheAxesOnceAndJudgesWhatTheSensorRead) {
  ImuNoise imu{.max_accel_mps2 = 20};
  imu.axes.accel(2, 2) = 1.25;
  ImuHistory history(imu);
  EXPECT_TRUE(history.add({ms(0), Vec3(0.1, 0, 0), Vec3(0, 0, 19)}));
  EXPECT_DOUBLE_EQ(history.newest().accel_mps2.z(), 15.2);
  EXPECT_FALSE(history.add({ms(5), Vec3(0.1, 0, 0), Vec3(0, 0, 21)}))
      << "beyond the range of the reading, if not of what it means";
}

}  // namespace imu_history_test
}  // namespace fbvins
