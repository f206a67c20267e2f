// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/record_sink.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <map>

#include "fbvins/io/dataset.hpp"
#include "fbvins/io/mcap_reader.hpp"

namespace fbvins {
namespace record_sink_test {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

StereoRig small_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 15, 11}, 32, 24), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  return rig;
}

Time at(int ms) { return {1'600'000'000'000'000'000 + ms * 1'000'000LL}; }

class RecordSinkTest : public ::testing::Test {
 protected:
  RecordSinkTest() { fs::create_directories(folder_); }
  ~RecordSinkTest() override { fs::remove_all(folder_); }

  std::unique_ptr<RecordSink> create() {
    auto sink = RecordSink::create(path_, small_rig(), {.program = "a test"});
    EXPECT_TRUE(sink) << sink.error().message;
    return *std::move(sink);
  }

  /// Messages of each topic, as far as they have reached the file.
  std::map<std::string, int> topics() const {
    std::map<std::string, int> counts;
    auto bytes = open_bytes(path_);
    if (!bytes) return counts;
    auto reader = McapReader::open(*bytes, path_);
    if (!reader) return counts;
    while (const auto message = reader->next()) ++counts[message->channel->topic];
    return counts;
  }

  /// Looks until the file holds that many readings.
  bool holds_readings(int count) const {
    for (int i = 0; i < 1000; ++i, std::this_thread::sleep_for(10ms))
      if (topics()["/imu"] >= count) return true;
    return false;
  }

  const std::string folder_ = ::testing::TempDir() + "/fbvins_record_sink_" + std::to_string(getpid());
  const std::string path_ = folder_ + "/flight.mcap";
};

TEST_F(RecordSinkTest, EveryEventHasItsTopic) {
  const auto sink = create();
  const auto image = std::make_shared<const Image>(32, 24, std::uint8_t{9});
  Odometry odometry;
  odometry.t = at(0);
  LivePose pose;
  pose.t = at(0);
  MapUpdate map;
  map.t = at(0);
  const auto take = [&](const LiveEvent& event) { EXPECT_TRUE(sink->take(event)); };
  take(LiveStatus{});  // before any sensor: at no time
  take(ImuSample{at(0)});
  take(StereoFrame{at(0), {image, image}});
  take(StereoFrame{at(50), {image}});
  take(odometry);  // without a pose: its health only
  take(pose);
  take(map);  // not localised: nothing to say
  odometry.health = pose.health = {HealthState::good, HealthReason::none};
  map.localised = true;
  take(odometry);
  take(pose);
  take(map);
  LiveStatus status;
  status.t = at(60);
  take(status);
  take(LiveView{});
  take(LiveMark{});  // before any sensor
  take(LiveMark{at(70), "here"});
  ASSERT_TRUE(sink->finish());
  const std::map<std::string, int> expected = {{"/imu", 1},
                                               {"/camera/left", 2},
                                               {"/camera/right", 1},
                                               {"/camera/left/camera_info", 2},
                                               {"/camera/right/camera_info", 1},
                                               {"/tf_static", 1},
                                               {"/health", 3},
                                               {"/odometry", 1},
                                               {"/odometry/live", 1},
                                               {"/tf", 2},
                                               {"/landmarks", 1},
                                               {"/marks", 1}};
  EXPECT_EQ(topics(), expected);
}

TEST_F(RecordSinkTest, WhatWasTakenReachesTheFileWithoutFurtherEvents) {
  const auto sink = create();
  ASSERT_TRUE(sink->take(ImuSample{at(0)}));
  ASSERT_TRUE(sink->take(ImuSample{at(5)}));
  EXPECT_TRUE(holds_readings(2));
}

TEST_F(RecordSinkTest, AKillLeavesAReadableFile) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto sink = create();
    const auto image = std::make_shared<const Image>(32, 24, std::uint8_t{9});
    for (int i = 0;; ++i) {
      (void)sink->take(ImuSample{at(5 * i)});
      (void)sink->take(StereoFrame{at(5 * i), {image, image}});
      if (i > 200) std::this_thread::sleep_for(1ms);
    }
  }
  const bool written = holds_readings(100);
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  ASSERT_TRUE(written);
  const int readings = topics()["/imu"];
  auto data = open_dataset(path_);
  ASSERT_TRUE(data) << data.error().message;
  int taken = 0;
  while (const auto event = (*data)->next()) taken += std::holds_alternative<ImuSample>(*event);
  EXPECT_EQ(taken, readings);
  EXPECT_GE(taken, 100);
}

TEST_F(RecordSinkTest, AStampThatCannotBeWrittenIsSaidAndTheRestIsRecorded) {
  const auto sink = create();
  EXPECT_FALSE(sink->take(ImuSample{Time{-5}}));
  EXPECT_TRUE(sink->take(ImuSample{at(5)}));
  ASSERT_TRUE(sink->finish());
  EXPECT_EQ(topics()["/imu"], 1);
}

TEST_F(RecordSinkTest, WhereTheFileExistsTheNextNumberIsTaken) {
  for (const char* expected : {"/flight.mcap", "/flight-2.mcap", "/flight-3.mcap"}) {
    auto sink = RecordSink::create_next(path_, small_rig(), {});
    ASSERT_TRUE(sink) << sink.error().message;
    EXPECT_EQ((*sink)->path(), folder_ + expected);
    EXPECT_EQ((*sink)->name(), "record " + folder_ + expected);
  }
  EXPECT_FALSE(RecordSink::create_next(folder_ + "/none/flight.mcap", small_rig(), {})) << "no number helps there";
}

TEST_F(RecordSinkTest, EndsWholeBeforeTheDiskIsFull) {
  std::atomic<std::uint64_t> free{2'000'000};
  auto made = RecordSink::create(path_, small_rig(), {},
                                 {.keep_free_bytes = 1'000'000, .free_bytes = [&](const std::string&) { return free.load(); }});
  ASSERT_TRUE(made) << made.error().message;
  RecordSink& sink = **made;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(sink.take(ImuSample{at(5 * i)}));
  free = 999'999;
  Result<void> taken;
  for (int i = 10; taken && i < 5000; ++i, std::this_thread::sleep_for(2ms)) taken = sink.take(ImuSample{at(5 * i)});
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().message, "the record has ended: less than 1 MB are free on its disk");
  const auto size = fs::file_size(path_);
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(sink.take(ImuSample{at(100'000 + i)})) << "said once";
  EXPECT_TRUE(sink.finish());
  EXPECT_EQ(fs::file_size(path_), size);
  EXPECT_GE(topics()["/imu"], 10);
  const auto refused =
      RecordSink::create(folder_ + "/second.mcap", small_rig(), {},
                         {.keep_free_bytes = 1'000'000, .free_bytes = [&](const std::string&) { return free.load(); }});
  EXPECT_FALSE(refused);
}

}  // namespace record_sink_test
}  // namespace fbvins
