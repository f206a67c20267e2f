// SPDX-License-Identifier: Apache-2.0
#include "apps/live_outputs.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "fbvins/io/imu_state_file.hpp"
#include "tests/support/no_sensors.hpp"
#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace live_outputs_test {

namespace fs = std::filesystem;

class LiveOutputs : public ::testing::Test {
 protected:
  LiveOutputs() {
    ::unsetenv("NOTIFY_SOCKET");
    arguments.quiet = true;
  }

  LiveSystem live() {
    auto made = LiveSystem::create(config, config.live, source.rig());
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return std::move(*made);
  }
  Result<void> add_to(LiveSystem& to) {
    LiveFlight flight{config, source, "none", map};
    return add_outputs(arguments, flight, to, totals, troubles);
  }

  const test::Folder own_folder{"live_outputs"};
  const std::string folder = own_folder.path();
  Config config;
  test::NoSensors source;
  MapArguments map;
  OutputArguments arguments;
  LiveTotals totals;
  Troubles troubles;
};

TEST_F(LiveOutputs, ARecordThatExistsGetsTheNextNumber) {
  arguments.record = folder + "/flight.mcap";
  arguments.record_keep_free_mb = 0;
  std::ofstream(arguments.record) << "the flight before";
  LiveSystem flight = live();
  ASSERT_TRUE(add_to(flight));
  EXPECT_FALSE(troubles.any());
  ASSERT_TRUE(flight.finish());
  EXPECT_EQ(fs::file_size(arguments.record), 17u);
  EXPECT_GT(fs::file_size(folder + "/flight-2.mcap"), 100u);
}

TEST_F(LiveOutputs, WhatCannotBeOpenedIsInTheStatusAndTheFlightGoesOn) {
  arguments.record = folder + "/unplugged/flight.mcap";
  LiveSystem flight = live();
  ASSERT_TRUE(add_to(flight));
  EXPECT_TRUE(troubles.any());
  EXPECT_NE(flight.status().problem.find("record: " + arguments.record), std::string::npos) << flight.status().problem;
  EXPECT_TRUE(flight.finish());
}

TEST_F(LiveOutputs, AFolderThatCannotBeMadeIsSaid) {
  std::ofstream(folder + "/file") << "no folder";
  arguments.out = folder + "/file/out";
  LiveSystem flight = live();
  ASSERT_TRUE(add_to(flight));
  EXPECT_TRUE(troubles.any());
  EXPECT_NE(flight.status().problem.find("files: "), std::string::npos) << flight.status().problem;
}

TEST_F(LiveOutputs, AWrongCommandLineIsAnError) {
  arguments.mavlink = {"nonsense"};
  LiveSystem flight = live();
  EXPECT_FALSE(add_to(flight));
  arguments.mavlink = {"udp:127.0.0.1:9:0"};
  config.live.mavlink.mounting.local_frame = LocalOrigin::map;
  const Result<void> without_map = add_to(flight);
  ASSERT_FALSE(without_map);
  EXPECT_NE(without_map.error().message.find("needs a map"), std::string::npos);
}

TEST_F(LiveOutputs, FilesAreThoseOfARun) {
  arguments.out = folder + "/out";
  map.loop = true;
  LiveSystem flight = live();
  ASSERT_TRUE(add_to(flight));
  ASSERT_TRUE(flight.finish());
  for (const char* name : {"trajectory.csv", "trajectory_tum.txt", "live_tum.txt", "statistics.csv", "map_causal_tum.txt"})
    EXPECT_TRUE(fs::exists(arguments.out + "/" + name)) << name;
}

TEST_F(LiveOutputs, AnImuStateThatCannotBeUsedIsSetAside) {
  const std::string file = folder + "/imu.yaml";
  EXPECT_FALSE(imu_state_for_flight(file, ImuNoise{})) << "the first flight";
  for (const char* damaged : {"", "imu_state: 1\nt_ns", "\x01\x02"}) {
    std::ofstream(file) << damaged;
    EXPECT_FALSE(imu_state_for_flight(file, ImuNoise{}));
    EXPECT_FALSE(fs::exists(file)) << "the way is free for this flight's";
  }
  EXPECT_TRUE(fs::exists(file + ".bad") && fs::exists(file + ".bad2") && fs::exists(file + ".bad3"));
  ImuNoise other;
  other.rate_hz += 1;
  ASSERT_TRUE(write_imu_state(file, ImuState{}, other));
  EXPECT_FALSE(imu_state_for_flight(file, ImuNoise{})) << "another IMU's";
  ASSERT_TRUE(write_imu_state(file, ImuState{}, ImuNoise{}));
  EXPECT_TRUE(imu_state_for_flight(file, ImuNoise{}));
  EXPECT_FALSE(imu_state_for_flight("", ImuNoise{}));
}

}  // namespace live_outputs_test
}  // namespace fbvins::app
