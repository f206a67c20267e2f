// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/clock_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace clock_guard_test {

Time at(double s) { return Time{Duration::from_seconds(s).ns}; }

/// IMU at 200 Hz and images at 20 Hz over `seconds`, in order; `jump` and `delay` are functions of the time of the event.
/// How many were not given a stamp.
template <class Jump, class Delay>
int play(ClockGuard& guard, double seconds, const Jump& jump, const Delay& delay, double& worst_s, double rate = 1) {
  int refused = 0;
  for (int k = 0; k < seconds * 200; ++k) {
    const double s = k * 0.005;
    const double stamp = 1000 + s * rate;
    const Time host = at(50 + s + delay(s));
    const auto give = [&](ClockGuard::Stream stream) {
      if (const auto event = guard.correct(stream, at(stamp + jump(s)), host)) {
        worst_s = std::max(worst_s, std::abs((event->t - at(stamp)).seconds()));
        refused -= event->held_back + event->other_too;
      } else {
        ++refused;
      }
    };
    give(ClockGuard::imu);
    if (k % 10 == 0) give(ClockGuard::camera);
  }
  return refused;
}

const auto no_jump = [](double) { return 0.0; };
const auto no_delay = [](double) { return 0.001; };

TEST(ClockGuard, LeavesStampsAlone) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(guard, 20, no_jump, no_delay, worst_s);
  EXPECT_EQ(worst_s, 0);
  EXPECT_EQ(guard.jumps(), 0);
}

TEST(ClockGuard, LateAndBunchedDataAreNoJump) {
  ClockGuard guard(1);
  double worst_s = 0;
  // All events of half a second arrive at its end.
  play(
      guard, 20, no_jump, [](double s) { return std::ceil(s * 2) / 2 - s; }, worst_s);
  EXPECT_EQ(worst_s, 0);
  EXPECT_EQ(guard.jumps(), 0);
}

TEST(ClockGuard, AClockThatDriftsIsNoJump) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(
      guard, 4000, no_jump, [](double s) { return 0.001 - 1e-4 * s; }, worst_s);  // 100 ppm, in all 0.4 s
  EXPECT_EQ(guard.jumps(), 0);
}

TEST(ClockGuard, JumpsForwardAndBackAreCorrected) {
  for (const double size_s : {1.0, -1.0, 0.3, -0.3, 0.22, 86400.0, -999.0}) {
    ClockGuard guard(1);
    double worst_s = 0;
    const int refused = play(
        guard, 30, [&](double s) { return s > 10 && s < 20 ? size_s : 0.0; }, no_delay, worst_s);
    EXPECT_LT(worst_s, 1e-6) << size_s;     // regular sensors: to the period
    EXPECT_EQ(guard.jumps(), 4) << size_s;  // two streams, there and back
    EXPECT_LT(refused, 2 * 6) << size_s;    // images of a quarter of a second each
  }
}

TEST(ClockGuard, CameraAndImuJumpByTheSame) {
  ClockGuard guard(1);
  // The camera's stamps jitter: alone it would put the jump some milliseconds off the IMU's.
  double between_s = 0;
  for (int k = 0; k < 4000; ++k) {
    const double s = k * 0.005, jump = s > 10 ? 5.0 : 0.0;
    const auto imu = guard.correct(ClockGuard::imu, at(1000 + s + jump), at(50 + s));
    if (k % 10 != 0) continue;
    const double jitter_s = 0.003 * std::sin(k);
    const auto image = guard.correct(ClockGuard::camera, at(1000 + s + jump + jitter_s), at(50 + s));
    if (image && imu) between_s = std::max(between_s, std::abs((image->t - imu->t).seconds() - jitter_s));
  }
  EXPECT_LT(between_s, 1e-6);
}

TEST(ClockGuard, ADeviceThatStartsAnewAfterASilenceGoesOnWhereTimeIs) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(guard, 10, no_jump, no_delay, worst_s);
  // Four seconds later, with stamps from zero.
  std::optional<ClockGuard::Event> corrected;
  int k = 0;
  for (; !corrected; ++k) {
    ASSERT_LT(k, 60);
    corrected = guard.correct(ClockGuard::imu, at(0.5 + 0.005 * k), at(50 + 14 + 0.001 + 0.005 * k));
  }
  EXPECT_NEAR((corrected->t - at(1014 + 0.005 * (k - 1))).seconds(), 0, 0.006);
  EXPECT_EQ(guard.corrected(ClockGuard::imu, at(0.5)), corrected->t - Duration::from_seconds(0.005 * (k - 1)));
  EXPECT_EQ(guard.jumps(), 1);
}

/// Stamps that are wrong alone, or data that come late, change no other stamp.
struct Late {
  const char* what;
  ClockGuard::Stream stream;
  bool (*late)(int k);  ///< of the k-th event of the stream
  double late_s;        ///< its stamp is earlier by this
};

TEST(ClockGuard, LateOrWrongStampsAreNoJump) {
  for (const Late& c : {Late{"one reading", ClockGuard::imu, [](int k) { return k == 2000; }, 0.15},
                        Late{"one image", ClockGuard::camera, [](int k) { return k == 200; }, 0.18},
                        Late{"one reading, early", ClockGuard::imu, [](int k) { return k == 2000; }, -0.15},
                        Late{"readings, early", ClockGuard::imu, [](int k) { return k % 500 == 499; }, -0.11},
                        Late{"one reading, slightly early", ClockGuard::imu, [](int k) { return k == 2000; }, -0.04},
                        Late{"one image, early", ClockGuard::camera, [](int k) { return k == 200; }, -0.19},
                        Late{"one image, slightly early", ClockGuard::camera, [](int k) { return k == 200; }, -0.09},
                        Late{"the first reading", ClockGuard::imu, [](int k) { return k == 0; }, -0.15},
                        Late{"the first reading of the future", ClockGuard::imu, [](int k) { return k == 0; }, -3600},
                        Late{"the first reading of the past", ClockGuard::imu, [](int k) { return k == 0; }, 3600},
                        Late{"five first readings", ClockGuard::imu, [](int k) { return k < 5; }, -1e5 * 3600},
                        Late{"the first image", ClockGuard::camera, [](int k) { return k == 0; }, -1},
                        Late{"the first image without a stamp", ClockGuard::camera, [](int k) { return k == 0; }, 1000},
                        Late{"two images", ClockGuard::camera, [](int k) { return k == 200 || k == 201; }, 0.3},
                        Late{"one reading of the future", ClockGuard::imu, [](int k) { return k == 2000; }, -3600},
                        Late{"one image of the future", ClockGuard::camera, [](int k) { return k == 200; }, -0.3},
                        Late{"every other reading", ClockGuard::imu, [](int k) { return k > 2000 && k % 2; }, 0.2},
                        Late{"two readings of three", ClockGuard::imu, [](int k) { return k > 2000 && k % 3; }, 0.2},
                        Late{"readings without stamps", ClockGuard::imu, [](int k) { return k % 10 == 9; }, 1000}}) {
    ClockGuard guard(1);
    int refused = 0, late = 0;
    for (int k = 0; k < 6000; ++k) {
      const double s = k * 0.005;
      const auto give = [&](ClockGuard::Stream stream, int index) {
        const bool wrong = stream == c.stream && c.late(index);
        // Stamps that are wrong are so by different amounts.
        const auto event = guard.correct(stream, at(1000 + s - (wrong ? c.late_s * (1 + 0.1 * (index % 5)) : 0)), at(50.001 + s));
        late += wrong, refused += event ? -event->held_back : 1;
        EXPECT_TRUE(!event || (!wrong && event->t == at(1000 + s))) << c.what;
      };
      give(ClockGuard::imu, k);
      if (k % 10 == 0) give(ClockGuard::camera, k / 10);
    }
    EXPECT_EQ(guard.jumps(), 0) << c.what;
    EXPECT_GE(refused, late) << c.what;
    EXPECT_LE(refused, late + 2) << c.what << ": the first right ones, before they are confirmed";
    EXPECT_NEAR(guard.host_of(at(1020)).seconds(), 70.001, 1e-3) << c.what;
  }
}

/// A camera that begins a second before the IMU.
TEST(ClockGuard, ACameraThatBeginsAloneMayBeginWithAWrongStamp) {
  ClockGuard guard(1);
  for (int k = 0; k < 2000; ++k) {
    const double s = k * 0.005;
    if (k % 10 == 0) {
      const auto image = guard.correct(ClockGuard::camera, at(1000 + s + (k == 0 ? 1 : 0)), at(50 + s));
      EXPECT_TRUE(k <= 10 ? !image : image && image->t == at(1000 + s)) << k;
    }
    if (k > 200) {
      const auto reading = guard.correct(ClockGuard::imu, at(1000 + s), at(50 + s));
      EXPECT_TRUE(reading && reading->t == at(1000 + s)) << k;
    }
  }
  EXPECT_EQ(guard.jumps(), 0);
}

/// A camera of which nothing is known but that its clock is the IMU's begins after a jump of it.
TEST(ClockGuard, AStreamThatBeginsAfterAJumpHasJumpedToo) {
  ClockGuard guard(1);
  for (int k = 0; k < 4000; ++k) {
    const double s = k * 0.005, jump = s > 5 ? 100 : 0;
    (void)guard.correct(ClockGuard::imu, at(1000 + s + jump), at(50 + s));
    if (s < 10 || k % 10 != 0) continue;
    const auto image = guard.correct(ClockGuard::camera, at(1000 + s + jump), at(50 + s));
    ASSERT_TRUE(image);
    EXPECT_EQ(image->t, at(1000 + s));
  }
}

/// A transport that had been slow for long: no reading is lost, and the clock has not jumped.
TEST(ClockGuard, ATransportThatBecomesFasterIsNoJump) {
  ClockGuard guard(1);
  double worst_s = 0;
  const int refused = play(
      guard, 40, no_jump, [](double s) { return s < 20 ? 0.15 : 0.001; }, worst_s);
  EXPECT_EQ(guard.jumps(), 0);
  EXPECT_EQ(worst_s, 0);
  EXPECT_EQ(refused, 0);
  EXPECT_NEAR(guard.host_of(at(1035)).seconds(), 85.001, 1e-6);
}

/// Readings of 200 ms that arrive in one block, after newer ones.
TEST(ClockGuard, ABlockOfLateReadingsIsNoJump) {
  ClockGuard guard(1);
  const auto give = [&](int k, int now) { return guard.correct(ClockGuard::imu, at(1000 + 0.005 * k), at(50 + 0.005 * now)); };
  for (int k = 0; k < 400; ++k) (void)give(k, k);
  for (int k = 440; k < 460; ++k) EXPECT_TRUE(give(k, k));
  for (int k = 400; k < 440; ++k) (void)give(k, 460);
  for (int k = 460; k < 800; ++k) {
    const auto event = give(k, k);
    EXPECT_TRUE(event && event->t == at(1000 + 0.005 * k)) << k;
  }
  EXPECT_EQ(guard.jumps(), 0);
}

/// A clock that jumps there and back by about the same has its old correction again, not one that is a few milliseconds off.
TEST(ClockGuard, AJumpBackIsUndoneExactly) {
  ClockGuard guard(1);
  std::optional<ClockGuard::Event> last;
  for (int k = 0; k < 6000; ++k) {
    const double s = k * 0.005, jump = s > 10 && s < 20 ? 3 : 0, jitter_s = 0.002 * std::sin(7.0 * k);
    last = guard.correct(ClockGuard::imu, at(1000 + s + jump), at(50.003 + s + jitter_s));
  }
  EXPECT_EQ(guard.jumps(), 2);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->t, at(1000 + 5999 * 0.005));
}

/// Forwards it is no more than early, and so it is taken; backwards, IMU and camera must agree on what it is.
TEST(ClockGuard, AJumpTooSmallToBeSeenForwardsIsSeenByBothStreamsBackwards) {
  for (const double size_s : {0.08, 0.12, 0.15, 0.19}) {
    ClockGuard guard(1);
    double apart_s = 0;
    for (int k = 0; k < 4000; ++k) {
      const double s = k * 0.005, stamp = 1000 + s + (s > 8 && s < 12 ? size_s : 0.0);
      const auto imu = guard.correct(ClockGuard::imu, at(stamp), at(50 + s));
      if (k % 10 != 0) continue;
      const auto image = guard.correct(ClockGuard::camera, at(stamp), at(50 + s));
      if (image && imu) apart_s = std::max(apart_s, std::abs((image->t - imu->t).seconds()));
    }
    EXPECT_LT(apart_s, 1e-6) << size_s;
    EXPECT_EQ(guard.jumps(), size_s > 0.1 ? 2 : 0) << size_s;
  }
}

TEST(ClockGuard, ACounterThatWrapsIsContinuedExactly) {
  ClockGuard guard(1);
  constexpr std::int64_t kWrap = 4'294'967'296'000;
  std::optional<ClockGuard::Event> last;
  std::int64_t true_ns = 0;
  for (int k = 0; k < 4000; ++k) {
    true_ns = kWrap - 8'000'000'000 + k * 5'000'000LL;
    last = guard.correct(ClockGuard::imu, Time{true_ns % kWrap}, at(50.003 + k * 0.005 + 0.002 * std::sin(7.0 * k)));
  }
  EXPECT_EQ(guard.jumps(), 1);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->t.ns, true_ns);
}

/// How often a stream says that the clock was set back, and by how much the last time.
struct SetBack {
  int times = 0;
  double by_s = 0;
};
template <class Jump>
SetBack set_back(const Jump& jump, double camera_first_s = 0) {
  ClockGuard guard(1);
  SetBack out;
  for (int k = 0; k < 6000; ++k) {
    const double s = k * 0.005;
    const auto give = [&](ClockGuard::Stream stream, double when_s) {
      const auto event = guard.correct(stream, at(1000 + when_s + jump(when_s)), at(50.001 + when_s));
      if (event && event->set_back.ns > 0) ++out.times, out.by_s = event->set_back.seconds();
    };
    if (k % 10 == 0) give(ClockGuard::camera, s - camera_first_s);
    give(ClockGuard::imu, s);
  }
  return out;
}

TEST(ClockGuard, AClockThatIsSetBackSaysSoOnceForBothStreams) {
  for (const double size_s : {0.12, 0.3, 1.0, 999.0})
    for (const double camera_first_s : {0.0, 0.002}) {
      const SetBack said = set_back([&](double s) { return s > 10 ? -size_s : 0.0; }, camera_first_s);
      EXPECT_EQ(said.times, 1) << size_s;
      EXPECT_NEAR(said.by_s, size_s, 0.006) << size_s;
    }
  EXPECT_EQ(set_back([](double s) { return s > 20 ? -2.0 : s > 10 ? -1.0 : 0.0; }).times, 2);
}

/// Where time has gone is known: it has leapt ahead, or is again what it was, or a counter has wrapped.
TEST(ClockGuard, AClockThatLeapsAheadAndReturnsIsNotSetBack) {
  EXPECT_EQ(set_back([](double s) { return s > 10 ? 3.0 : 0.0; }).times, 0);
  EXPECT_EQ(set_back([](double s) { return s > 10 && s < 20 ? 3.0 : 0.0; }).times, 0);
  EXPECT_EQ(set_back([](double s) { return s > 10 ? -4294.967296 : 0.0; }).times, 0);
}

TEST(ClockGuard, SaysWhenAStampWasOnThisMachine) {
  ClockGuard guard(1);
  double worst_s = 0;
  play(
      guard, 20, no_jump, [](double s) { return 0.002 + 0.01 * std::abs(std::sin(17 * s)); }, worst_s);
  EXPECT_NEAR(guard.host_of(at(1020)).seconds(), 70.002, 5e-4);
}

TEST(ClockGuard, ARecordingPlayedFasterIsNoJump) {
  ClockGuard guard(4);
  double worst_s = 0;
  play(guard, 20, no_jump, no_delay, worst_s, 4);
  EXPECT_EQ(guard.jumps(), 0);
  EXPECT_NEAR(guard.host_of(at(1040)).seconds(), 60.001, 1e-6);
}

}  // namespace clock_guard_test
}  // namespace fbvins
