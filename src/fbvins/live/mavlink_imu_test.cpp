// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_imu.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace fbvins {
namespace mavlink_imu_test {

constexpr std::int64_t kMs = 1'000'000;
constexpr MavlinkAddress kAutopilot{7, 1};

template <class T>
std::vector<T> only(const MavlinkImu::Frames& frames) {
  MavlinkDecoder decoder;
  std::vector<T> chosen;
  for (const auto& frame : frames)
    for (const auto& read : decoder.push(frame))
      if (const auto* one = std::get_if<T>(&read.message)) chosen.push_back(*one);
  return chosen;
}

HighresImuMessage highres(Time theirs) {
  HighresImuMessage m;
  m.time_usec = static_cast<std::uint64_t>(theirs.ns / 1000);
  m.acc = {0.5f, 0, -9.8f}, m.gyro = {0, 0.25f, 0};
  m.fields_updated = 0xffff;
  return m;
}

/// A flight controller with a reading every 5 ms, whose clock is ahead and drifts; its messages take 1 to 3 ms.
struct FlightController {
  MavlinkImu imu;
  double ahead_s = 500, drift = 50e-6;
  std::int64_t step = 0;
  std::function<MavlinkMessage(Time theirs)> reading = [](Time t) { return highres(t); };
  bool answers = true;
  MavlinkImu::Frames heard;
  std::vector<ImuSample> samples;
  double worst_s = 0;
  std::vector<Time> true_times;

  Time now() const { return Time{1'000 * kMs + step * 5 * kMs}; }
  Time theirs(Time t) const { return t + Duration::from_seconds(ahead_s + drift * t.seconds()); }
  Duration delay() const { return Duration{kMs + (step * 7919 % 5) * kMs / 2}; }

  void hear(const MavlinkMessage& message, Time at) {
    for (const ImuSample& sample : imu.receive(encode_mavlink(message, kAutopilot, 0), at)) samples.push_back(sample);
  }
  void run(double seconds) {
    for (const std::int64_t end = step + static_cast<std::int64_t>(seconds * 200); step < end; ++step) {
      if (step % 200 == 0) {
        HeartbeatMessage beat;
        beat.autopilot = 12;
        hear(beat, now());
      }
      const auto frames = imu.tick(now());
      heard.insert(heard.end(), frames.begin(), frames.end());
      for (const auto& question : only<TimesyncMessage>(frames))
        if (answers) hear(TimesyncMessage{theirs(now() + delay()).ns, question.ts1}, now() + delay() + delay());
      const std::size_t before = samples.size();
      hear(reading(theirs(now())), now() + delay());
      if (samples.size() > before) worst_s = std::max(worst_s, std::abs((samples.back().t - now()).seconds()));
    }
  }
};

TEST(MavlinkImu, BringsReadingsToThisMachinesClock) {
  FlightController fc;
  fc.run(20);
  ASSERT_GT(fc.samples.size(), 3700u);
  EXPECT_LT(fc.worst_s, 1e-3);
  EXPECT_EQ(fc.samples.back().accel_mps2, Vec3(0.5f, 0, -9.8f));
  EXPECT_EQ(fc.samples.back().gyro_radps, Vec3(0, 0.25f, 0));
  for (std::size_t i = 1; i < fc.samples.size(); ++i)
    EXPECT_NEAR((fc.samples[i].t - fc.samples[i - 1].t).seconds(), 5e-3, 3e-5) << i;
}

TEST(MavlinkImu, ReturnsNothingBeforeTheClockOffsetIsKnown) {
  FlightController fc;
  fc.answers = false;
  fc.run(3);
  EXPECT_TRUE(fc.samples.empty());
  fc.answers = true;
  fc.run(2);
  EXPECT_GT(fc.samples.size(), 100u);
}

TEST(MavlinkImu, LearnsTheClockOfAFlightControllerThatRestarted) {
  FlightController fc;
  fc.run(5);
  fc.ahead_s = -0.9;  // its clock begins anew
  const std::size_t before = fc.samples.size();
  fc.run(0.2);
  EXPECT_LE(fc.samples.size(), before + 2);
  EXPECT_GT(fc.imu.refused(), 0);
  fc.worst_s = 0;
  fc.run(5);
  EXPECT_GT(fc.samples.size(), before + 700);
  EXPECT_LT(fc.worst_s, 1e-3);
  for (std::size_t i = 1; i < fc.samples.size(); ++i) EXPECT_LT(fc.samples[i - 1].t, fc.samples[i].t);
}

TEST(MavlinkImu, KeepsReadingsThatWaitedInThePort) {
  FlightController fc;
  fc.run(3);
  const Time then = fc.now();
  const std::size_t before = fc.samples.size();
  fc.hear(highres(fc.theirs(then)), then + Duration{1'500 * kMs});
  ASSERT_EQ(fc.samples.size(), before + 1);
  EXPECT_LT(std::abs((fc.samples.back().t - then).seconds()), 1e-3);
  EXPECT_EQ(fc.imu.refused(), 0);
  fc.hear(highres(fc.theirs(then + Duration{5 * kMs})), then + Duration{4'000 * kMs});
  EXPECT_EQ(fc.samples.size(), before + 1) << "of another clock";
  EXPECT_EQ(fc.imu.refused(), 1);
}

TEST(MavlinkImu, RequestsReadingsUntilTheyCome) {
  FlightController fc;
  fc.reading = [](Time) { return HeartbeatMessage{}; };  // of no autopilot: ignored
  fc.run(6);
  const auto requests = only<CommandMessage>(fc.heard);
  ASSERT_GT(requests.size(), 5u);
  EXPECT_EQ(requests[0].command, 511);
  EXPECT_EQ(requests[0].params[0], 105);
  EXPECT_EQ(requests[0].params[1], 5000);
  EXPECT_EQ(requests[0].target_system, 7);
  EXPECT_EQ(requests.back().params[0], 26);
  fc.reading = [](Time t) { return highres(t); };
  fc.run(1);
  fc.heard.clear();
  fc.run(5);
  EXPECT_TRUE(only<CommandMessage>(fc.heard).empty());
  EXPECT_EQ(only<HeartbeatMessage>(fc.heard).size(), 5u);
}

TEST(MavlinkImu, TakesTheCoarseMessageWhereTheOtherDoesNotCome) {
  FlightController fc;
  fc.reading = [](Time theirs) {
    ScaledImuMessage m;
    m.time_boot_ms = static_cast<std::uint32_t>(theirs.ns / kMs);
    m.acc = {0, 500, -1000}, m.gyro = {100, 0, 0};
    return m;
  };
  fc.run(3);
  ASSERT_GT(fc.samples.size(), 300u);
  EXPECT_LT(fc.worst_s, 2.5e-3);
  EXPECT_LT((fc.samples.back().accel_mps2 - Vec3(0, 4.903325, -9.80665)).norm(), 1e-9);
  EXPECT_LT((fc.samples.back().gyro_radps - Vec3(0.1, 0, 0)).norm(), 1e-12);
}

TEST(MavlinkImu, CoarseReadingsGoOnWhenTheirCounterBeginsAnew) {
  FlightController fc;
  fc.ahead_s = 4'294'967.296 - 5, fc.drift = 0;  // its 32 bits of milliseconds end in four seconds
  fc.reading = [](Time theirs) {
    ScaledImuMessage m;
    m.time_boot_ms = static_cast<std::uint32_t>(theirs.ns / kMs);
    return m;
  };
  fc.run(10);
  EXPECT_GT(fc.samples.size(), 1700u);
  EXPECT_LT(fc.worst_s, 2.5e-3);
  EXPECT_EQ(fc.imu.refused(), 0);
}

TEST(MavlinkImu, AStampThatNoClockHasIsRefused) {
  FlightController fc;
  fc.run(3);
  const std::size_t before = fc.samples.size();
  for (const std::uint64_t usec : {~0ull, 1ull << 63, 10'000'000'000'000'000ull, 4'000'000'000'000'000ull}) {
    HighresImuMessage m = highres(fc.theirs(fc.now()));
    m.time_usec = usec;
    fc.hear(m, fc.now());
  }
  EXPECT_EQ(fc.samples.size(), before);
  EXPECT_EQ(fc.imu.refused(), 4);
  fc.run(1);
  EXPECT_GT(fc.samples.size(), before + 190);
}

TEST(MavlinkImu, AStrangersHeartbeatsDoNotTakeTheFlightControllersPlace) {
  FlightController fc;
  fc.run(2);
  const std::size_t before = fc.samples.size();
  for (int half_second = 0; half_second < 20; ++half_second) {
    HeartbeatMessage beat;
    beat.autopilot = 12;
    for (const MavlinkAddress stranger : {MavlinkAddress{7, 200}, MavlinkAddress{9, 1}})
      fc.imu.receive(encode_mavlink(beat, stranger, 0), fc.now());
    fc.run(0.5);
  }
  EXPECT_GE(fc.samples.size(), before + 1999);
}

TEST(MavlinkImu, LeavesOutOthersAndHalfReadings) {
  FlightController fc;
  fc.reading = [](Time t) {
    HighresImuMessage m = highres(t);
    m.fields_updated = 0x7;  // no rates
    return m;
  };
  fc.run(3);
  fc.reading = [](Time t) {
    HighresImuMessage m = highres(t);
    m.id = 1;  // a second IMU
    return m;
  };
  fc.run(3);
  EXPECT_TRUE(fc.samples.empty());
  for (const ImuSample& sample : fc.imu.receive(encode_mavlink(highres(fc.theirs(fc.now())), MavlinkAddress{9, 1}, 0), fc.now()))
    ADD_FAILURE() << "a reading of another vehicle, " << sample.t.ns;
}

}  // namespace mavlink_imu_test
}  // namespace fbvins
