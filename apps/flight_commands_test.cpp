// SPDX-License-Identifier: Apache-2.0
// The commands of a flight without sensors: what they need, and what they say. With sensors: tests/ros2_peer.py.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "apps/live_outputs.hpp"
#include "tests/support/no_sensors.hpp"
#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace flight_commands_test {

namespace fs = std::filesystem;

class FlightCommands : public ::testing::Test {
 protected:
  FlightCommands() {
    ::unsetenv("NOTIFY_SOCKET");
    outputs.quiet = true;
    outputs.record_keep_free_mb = 0;
    auto made = LiveSystem::create(config, config.live, source.rig());
    EXPECT_TRUE(made);
    live.emplace(std::move(*made));
  }

  /// What the command tells: "+" or "-", and the sentence.
  std::string ask(const std::string& name) {
    std::vector<FlightCommand> commands = flight_commands(flight, *live);
    const auto command = std::ranges::find(commands, name, &FlightCommand::name);
    std::string said = "nothing";
    command->act([&](const Result<std::string>& done) { said = done ? "+" + *done : "-" + done.error().message; });
    return said;
  }
  void add() { ASSERT_TRUE(add_outputs(outputs, flight, *live, totals, troubles)); }

  const test::Folder own_folder{"flight_commands"};
  const std::string folder = own_folder.path();
  Config config;
  test::NoSensors source;
  MapArguments map;
  OutputArguments outputs;
  LiveTotals totals;
  Troubles troubles;
  LiveFlight flight{config, source, "none", map};
  std::optional<LiveSystem> live;
};

TEST_F(FlightCommands, SayWhatTheyNeed) {
  add();
  EXPECT_EQ(ask("reset"), "+the estimator starts again with the next image");
  EXPECT_EQ(ask("start_record"), "-no file for records was named: start with --record FILE");
  EXPECT_EQ(ask("save_map"), "-this flight has no map: start it with --map FILE");
  EXPECT_EQ(ask("load_map"), "-this flight has no map: start it with --map FILE");
  map.loop = true;
  EXPECT_EQ(ask("save_map"), "-no file for the map was named: start with --map FILE or --save-map FILE");
  EXPECT_EQ(ask("load_map"), "-no file of a map was named: start with --map FILE or --load-map FILE");
  map.save = folder + "/flat.fbm";
  EXPECT_EQ(ask("save_map"), "-there is no pose: the map is saved with the next keyframe, which needs one");
  EXPECT_EQ(ask("load_map"), "-there is no pose: the map is loaded before the next keyframe, which needs one");
}

TEST_F(FlightCommands, ARecordBeginsAndEndsOnRequest) {
  outputs.record = folder + "/flight.mcap";
  outputs.record_on_request = true;
  add();
  EXPECT_FALSE(fs::exists(outputs.record));
  EXPECT_EQ(ask("stop_record"), "-no record is being written");
  EXPECT_EQ(ask("start_record"), "+recording " + outputs.record);
  EXPECT_EQ(ask("start_record"), "-a record is being written: " + outputs.record);
  EXPECT_EQ(ask("stop_record"), "+the record is " + outputs.record);
  EXPECT_EQ(ask("start_record"), "+recording " + folder + "/flight-2.mcap");
  ASSERT_TRUE(live->finish());
  EXPECT_GT(fs::file_size(folder + "/flight-2.mcap"), 100u);
}

TEST_F(FlightCommands, ARecordThatBeganWithTheFlightCanBeEnded) {
  outputs.record = folder + "/flight.mcap";
  add();
  EXPECT_EQ(ask("stop_record"), "+the record is " + outputs.record);
  EXPECT_EQ(live->status().problem, "");
}

}  // namespace flight_commands_test
}  // namespace fbvins::app
