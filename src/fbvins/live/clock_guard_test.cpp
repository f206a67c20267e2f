// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/clock_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace {

Time at(double s) { return Time{Duration::from_seconds(s).ns}; }

/// IMU at 200 Hz and images at 20 Hz over `seconds`, in order; `leap` and `delay` are functions of the time of the event.
template <class Leap, class Delay>
void play(ClockGuard& guard, double seconds, const Leap& leap, const Delay& delay, double& worst_s, double rate = 1) {
  for (int k = 0; k < seconds * 200; ++k) {
    const double s = k * 0.005;
    const double stamp = 1000 + s * rate;
    const Time host = at(50 + s + delay(s));
    const auto error = [&](Time mended) { return std::abs((mended - at(stamp)).seconds()); };
    worst_s = std::max(worst_s, error(guard.mend(ClockGuard::imu, at(stamp + leap(s)), host)));
    if (k % 10 == 0) worst_s = std::max(worst_s, error(guard.mend(ClockGuard::camera, at(stamp + leap(s)), host)));
  }
}

const auto no_leap = [](double) { return 0.0; };
const auto no_delay = [](double) { return 0.001; };

TEST(ClockGuard, LeavesStampsAlone) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(guard, 20, no_leap, no_delay, worst_s);
  EXPECT_EQ(worst_s, 0);
  EXPECT_EQ(guard.leaps(), 0);
}

TEST(ClockGuard, LateAndBunchedDataAreNoLeap) {
  ClockGuard guard(1);
  double worst_s = 0;
  // All events of half a second arrive at its end.
  play(
      guard, 20, no_leap, [](double s) { return std::ceil(s * 2) / 2 - s; }, worst_s);
  EXPECT_EQ(worst_s, 0);
  EXPECT_EQ(guard.leaps(), 0);
}

TEST(ClockGuard, AClockThatDriftsIsNoLeap) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(
      guard, 4000, no_leap, [](double s) { return 0.001 - 1e-4 * s; }, worst_s);  // 100 ppm, in all 0.4 s
  EXPECT_EQ(guard.leaps(), 0);
}

TEST(ClockGuard, LeapsForwardAndBackAreMended) {
  for (const double size_s : {1.0, -1.0, 0.3, -0.3, 86400.0, -999.0}) {
    ClockGuard guard(1);
    double worst_s = 0;
    play(
        guard, 30, [&](double s) { return s > 10 && s < 20 ? size_s : 0.0; }, no_delay, worst_s);
    EXPECT_LT(worst_s, 1e-6) << size_s;     // regular sensors: to the period
    EXPECT_EQ(guard.leaps(), 4) << size_s;  // two streams, there and back
  }
}

TEST(ClockGuard, CameraAndImuLeapByTheSame) {
  ClockGuard guard(1);
  // The camera's stamps jitter: alone it would put the leap some milliseconds off the IMU's.
  double between_s = 0;
  for (int k = 0; k < 4000; ++k) {
    const double s = k * 0.005, leap = s > 10 ? 5.0 : 0.0;
    const Time imu = guard.mend(ClockGuard::imu, at(1000 + s + leap), at(50 + s));
    if (k % 10 != 0) continue;
    const double jitter_s = 0.003 * std::sin(k);
    const Time image = guard.mend(ClockGuard::camera, at(1000 + s + leap + jitter_s), at(50 + s));
    between_s = std::max(between_s, std::abs((image - imu).seconds() - jitter_s));
  }
  EXPECT_LT(between_s, 1e-6);
}

TEST(ClockGuard, ADeviceThatStartsAnewAfterASilenceGoesOnWhereTimeIs) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(guard, 10, no_leap, no_delay, worst_s);
  // Four seconds later, with stamps from zero.
  const Time mended = guard.mend(ClockGuard::imu, at(0.5), at(50 + 14 + 0.001));
  EXPECT_NEAR((mended - at(1014)).seconds(), 0, 0.006);
  EXPECT_EQ(guard.leaps(), 1);
}

TEST(ClockGuard, SaysWhenAStampWasOnThisMachine) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(
      guard, 20, no_leap, [](double s) { return 0.002 + 0.01 * std::abs(std::sin(17 * s)); }, worst_s);
  EXPECT_NEAR(guard.host_of(at(1020)).seconds(), 70.002, 5e-4);
}

TEST(ClockGuard, ARecordingPlayedFasterIsNoLeap) {
  ClockGuard guard(4);
  double worst_s = 0;
  play(guard, 20, no_leap, no_delay, worst_s, 4);
  EXPECT_EQ(guard.leaps(), 0);
  EXPECT_NEAR(guard.host_of(at(1040)).seconds(), 60.001, 1e-6);
}

}  // namespace
}  // namespace fbvins
