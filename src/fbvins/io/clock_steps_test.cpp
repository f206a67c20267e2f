// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/clock_steps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/io/camera_recording.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/io/euroc_folder.hpp"

namespace fbvins {
namespace clock_steps_test {

constexpr std::int64_t kMs = 1'000'000;

/// Every `period_ms` from 100 s on; from number `at` on another clock.
std::vector<Time> stamps(int count, int period_ms, int at, std::int64_t back_ms) {
  std::vector<Time> out;
  for (int i = 0; i < count; ++i) out.push_back(Time{(100'000 + i * period_ms - (i >= at ? back_ms : 0)) * kMs});
  return out;
}

TEST(ClockSteps, AClockThatIsSetBackIsFound) {
  EXPECT_TRUE(clock_steps(stamps(200, 50, 100, 0)).empty());
  for (const std::int64_t back_ms : {100, 137, 1000, 60'000, 1'000'000'000})
    EXPECT_EQ(clock_steps(stamps(200, 50, 100, back_ms)), std::vector<std::size_t>{100}) << back_ms;
  EXPECT_EQ(clock_steps(stamps(2000, 5, 1000, 1000)), std::vector<std::size_t>{1000});
  std::vector<Time> twice = stamps(300, 50, 100, 1000);
  for (std::size_t i = 200; i < twice.size(); ++i) twice[i].ns -= 2000 * kMs;
  EXPECT_EQ(clock_steps(twice), (std::vector<std::size_t>{100, 200}));
}

TEST(ClockSteps, WrongAndLateRowsAreNone) {
  std::vector<Time> one = stamps(200, 50, 200, 0);
  one[100].ns -= 1000 * kMs;
  EXPECT_TRUE(clock_steps(one).empty()) << "one row";
  one[100].ns += 5000 * kMs;
  EXPECT_TRUE(clock_steps(one).empty()) << "one row of the future";
  std::vector<Time> late = stamps(200, 5, 200, 0);
  std::rotate(late.begin() + 100, late.begin() + 120, late.begin() + 140);
  EXPECT_TRUE(clock_steps(late).empty()) << "a block that came late fills a gap";
  EXPECT_TRUE(clock_steps({}).empty());
  EXPECT_TRUE(clock_steps({Time{5}}).empty());
}

/// In a time that does not grow with the square of their number.
TEST(ClockSteps, StampsThatFollowNoClockHaveNone) {
  std::vector<Time> teeth, holes;
  for (int i = 0; i < 400'000; ++i) {
    teeth.push_back(Time{(i % 8) * 50 * kMs});
    holes.push_back(Time{(i / 8 * 800 + (i / 8 % 2 == 0 ? 800 : -800) + i % 8 * 50) * kMs});
  }
  EXPECT_TRUE(clock_steps(teeth).empty());
  EXPECT_TRUE(clock_steps(holes).empty());
}

TEST(ClockSteps, StreamsAreContinuedTogether) {
  StampStream images{"images", stamps(200, 50, 100, 1000)}, imu{"imu", stamps(2000, 5, 1003, 1000)}, none{"none", {}};
  const JoinedClock clock = join_clock({&images, &imu, &none});
  ASSERT_EQ(clock.begins.size(), 1u);
  EXPECT_EQ(clock.said.size(), 1u);
  EXPECT_NE(clock.said[0].find("set back by 1.0"), std::string::npos) << clock.said[0];
  EXPECT_EQ(images.stamps[100], Time{(100'000 + 100 * 50 - 1000) * kMs} + clock.added[1]);
  EXPECT_EQ(imu.stamps[1003], Time{(100'000 + 1003 * 5 - 1000) * kMs} + clock.added[1]) << "by the same";
  EXPECT_LT(images.stamps[99], clock.begins[0]);
  EXPECT_GT(images.stamps[100], clock.begins[0]);
  EXPECT_LT(imu.stamps[1002], clock.begins[0]);
  EXPECT_GT(imu.stamps[1003], clock.begins[0]);
  EXPECT_GE((imu.stamps[1003] - imu.stamps[1002]).seconds(), 0.9) << "nobody integrates over it";
}

TEST(ClockSteps, WhatStepsAloneEndsThere) {
  StampStream images{"images", stamps(200, 50, 100, 1000)}, imu{"imu", stamps(2000, 5, 2000, 0)};
  const JoinedClock clock = join_clock({&images, &imu});
  EXPECT_TRUE(clock.begins.empty());
  EXPECT_EQ(images.kept, 100u);
  EXPECT_NEAR(static_cast<double>(imu.kept), 1000, 25);
  ASSERT_EQ(clock.said.size(), 1u);
  EXPECT_NE(clock.said[0].find("cannot be put in time"), std::string::npos) << clock.said[0];
}

TEST(ClockSteps, ReadingsThatCameTwiceAreNone) {
  std::vector<ImuSample> readings;
  for (const Time t : stamps(2000, 5, 2000, 0))
    readings.push_back({t, Vec3::Constant(static_cast<double>(t.ns % 1000)), Vec3::Zero()});
  const std::vector<ImuSample> again(readings.begin() + 700, readings.begin() + 1000);
  readings.insert(readings.begin() + 1000, again.begin(), again.end());
  StampStream images{"images", stamps(200, 50, 200, 0)}, imu = stream_of("imu", readings);
  EXPECT_EQ(clock_steps(imu.stamps).size(), 1u);
  const JoinedClock clock = join_clock({&images, &imu});
  EXPECT_TRUE(clock.said.empty());
  EXPECT_EQ(imu.kept, imu.stamps.size());
}

TEST(ClockSteps, ACounterThatWrapsIsContinuedAndSaid) {
  const std::int64_t wrap = 4'294'967'296'000;
  StampStream imu{"imu", {}};
  for (int i = 0; i < 100; ++i) imu.stamps.push_back(Time{(wrap - 50 * 5 * kMs + i * 5 * kMs) % wrap});
  const JoinedClock clock = join_clock({&imu});
  EXPECT_EQ(clock.said.size(), 1u);
  EXPECT_TRUE(clock.begins.empty());
  for (std::size_t i = 1; i < imu.stamps.size(); ++i) EXPECT_EQ((imu.stamps[i] - imu.stamps[i - 1]).ns, 5 * kMs) << i;
}

/// A second of images and readings, whose clock is set back by 300 ms in the middle.
std::string folder_with_a_step(const std::string& name) {
  const std::string folder = ::testing::TempDir() + "/fbvins_" + name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 31.5, 23.5, 0, 0, 0, 0}, 64, 48), {}});
  rig.cameras[1].T_BC.p.x() = 0.1;
  auto recording = EurocFolder::create(folder, rig, "made by hand");
  EXPECT_TRUE(recording.ok());
  const auto image = std::make_shared<const Image>(64, 48, std::uint8_t{90});
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(recording->add({Time{i * 50 * kMs + 1}, {image, image}}, Time{i * 50 * kMs + 1}).ok());
  std::vector<ImuSample> readings;
  for (int i = 0; i < 400; ++i) readings.push_back({Time{i * 5 * kMs + 1}, Vec3(1e-6 * i, 0, 0), Vec3(0, 0, 9.81)});
  EXPECT_TRUE(recording->finish(readings, {}).ok());
  for (const char* file : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv"}) {
    const std::string path = folder + "/mav0/" + file;
    std::ifstream in(path);
    std::string text, line;
    while (std::getline(in, line)) {
      const std::size_t comma = line.find(',');
      if (line.front() == '#') continue;
      const std::int64_t t = std::stoll(line.substr(0, comma));
      text += std::to_string(t >= 1000 * kMs ? t - 300 * kMs : t) + line.substr(comma) + "\n";
    }
    std::ofstream(path) << text;
  }
  return folder;
}

TEST(ClockSteps, ARecordingBeginsAnewAfterThem) {
  const std::string folder = folder_with_a_step("clock_step");
  auto data = open_dataset(folder);
  ASSERT_TRUE(data.ok()) << data.error().message;
  EXPECT_EQ((*data)->info().frames, 40) << "no image is left out";
  EXPECT_EQ((*data)->info().imu_samples, 400);
  EXPECT_EQ((*data)->info().clock_steps.size(), 1u);
  EXPECT_EQ(
      std::ranges::count_if((*data)->info().warnings, [](const std::string& w) { return w.find("set back by 0.3") != w.npos; }),
      1);
  int images = 0, marked = -1;
  Time newest{-1};
  while (auto event = (*data)->next()) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (!frame) continue;
    if (frame->after_clock_step) marked = images;
    EXPECT_GT(frame->t, newest);
    newest = frame->t;
    ++images;
  }
  EXPECT_EQ(marked, 20);
  const auto board = open_euroc_cameras(folder);
  ASSERT_TRUE(board.ok());
  EXPECT_EQ(board->images.size(), 80u);
  EXPECT_EQ(board->warnings.size(), 1u);
  std::filesystem::remove_all(folder);
}

}  // namespace clock_steps_test
}  // namespace fbvins
