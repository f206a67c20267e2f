// SPDX-License-Identifier: Apache-2.0
// The companion's part with a fake PX4 that obeys at once and follows setpoints exactly.
#include "fbvins/flight/px4_mission.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace fbvins {
namespace px4_mission_test {

constexpr std::uint32_t kOffboardMode = 6U << 16, kLandMode = 4U << 16 | 6U << 24;

Mission hop() { return *parse_mission("steps:\n  - takeoff: 0.5\n  - hold: 1\n  - goto: [0.5, 0, 0.5]\n  - land\n", "hop.yaml"); }

struct FakePx4 {
  bool refuses = false, leaves = false, keeps_mode = false;
  HeartbeatMessage beat{.autopilot = 12};
  OdometryMessage odometry;
  std::vector<std::uint16_t> commands;
  int targets = 0;
  double landed_at_s = 0;

  void take(const MavlinkMessage& message, double now_s) {
    if (const auto* target = std::get_if<PositionTargetMessage>(&message)) {
      ++targets;
      if (beat.base_mode != 0) odometry.x = target->x, odometry.y = target->y, odometry.z = target->z;
    }
    const auto* command = std::get_if<CommandMessage>(&message);
    if (command == nullptr) return;
    EXPECT_EQ(command->target_system, 2);
    commands.push_back(command->command);
    if (command->command == kMavCmdSetMode && !keeps_mode) beat.custom_mode = kOffboardMode;
    if (command->command == kMavCmdArm && !refuses) beat.base_mode = command->params[0] > 0 ? 128 : 0;
    if (command->command == kMavCmdLand) beat.custom_mode = kLandMode, landed_at_s = now_s + 2;
  }
  void go_on(double now_s) {
    if (leaves && now_s > 8 && beat.base_mode != 0)
      beat.custom_mode = kLandMode, landed_at_s = landed_at_s > 0 ? landed_at_s : now_s + 2;
    if (landed_at_s > 0 && now_s > landed_at_s) beat.base_mode = 0;
    odometry.time_usec = static_cast<std::uint64_t>(1e6 * (now_s + 10));
  }
};

/// Flies and returns the sequence of modes.
std::vector<FlightMode> fly(Px4Mission& mission, FakePx4& px4, double seconds, double odometry_ends_s = 1e9) {
  std::vector<FlightMode> modes;
  for (int i = 0; i < 200 * seconds; ++i) {
    const double now_s = i / 200.0;
    LivePose pose;
    pose.t = Time{1'000'000'000} + Duration::from_seconds(now_s);
    pose.estimate_t = std::min(pose.t, Time{1'000'000'000} + Duration::from_seconds(odometry_ends_s));
    pose.health = {HealthState::good, HealthReason::none};
    px4.go_on(now_s);
    mission.receive({{2, 1}, 0, px4.odometry}, now_s);
    if (i % 20 == 0) mission.receive({{2, 1}, 0, px4.beat}, now_s);
    for (const MavlinkMessage& message : mission.update(pose, now_s)) px4.take(message, now_s);
    if (modes.empty() || modes.back() != mission.output().mode) modes.push_back(mission.output().mode);
  }
  return modes;
}

TEST(Px4Mission, AsksForOffboardArmsFliesAndLands) {
  Px4Mission mission(hop(), 200, 2, 10);
  FakePx4 px4;
  px4.odometry.x = 4, px4.odometry.z = -0.2F;
  const auto modes = fly(mission, px4, 30);
  EXPECT_EQ(modes, (std::vector{FlightMode::waiting, FlightMode::mission, FlightMode::landing, FlightMode::landed}));
  EXPECT_EQ(mission.output().reason, FlightReason::none);
  EXPECT_EQ(mission.resets_in_flight(), 0);
  EXPECT_EQ(px4.commands, (std::vector{kMavCmdSetMessageInterval, kMavCmdSetMode, kMavCmdArm, kMavCmdLand}));
  EXPECT_NEAR(px4.odometry.x, 4.5, 0.01);
  EXPECT_NEAR(px4.odometry.z, -0.7, 0.01);
}

TEST(Px4Mission, GivesUpIfPx4DoesNotArm) {
  Px4Mission mission(hop(), 200, 2, 10);
  FakePx4 px4;
  px4.refuses = true;
  EXPECT_EQ(fly(mission, px4, 45), (std::vector{FlightMode::waiting, FlightMode::landed}));
  EXPECT_EQ(mission.output().reason, FlightReason::flight_controller);
  EXPECT_GT(std::count(px4.commands.begin(), px4.commands.end(), kMavCmdArm), 10);
}

TEST(Px4Mission, OdometryLostBeforeTakeOffEndsItOnTheGround) {
  for (const bool armed : {false, true}) {
    Px4Mission mission(hop(), 200, 2, 10);
    FakePx4 px4;
    px4.keeps_mode = true;
    px4.beat.base_mode = armed ? 128 : 0;
    EXPECT_EQ(fly(mission, px4, 10, 3), (std::vector{FlightMode::waiting, FlightMode::landed}));
    EXPECT_EQ(mission.output().reason, FlightReason::lost);
    EXPECT_EQ(px4.beat.base_mode, 0) << "disarmed";
  }
}

TEST(Px4Mission, ReportsWhatPx4DoesByItself) {
  Px4Mission mission(hop(), 200, 2, 10);
  FakePx4 px4;
  px4.leaves = true;
  EXPECT_EQ(fly(mission, px4, 30).back(), FlightMode::landed);
  EXPECT_EQ(mission.output().reason, FlightReason::flight_controller);
  EXPECT_EQ(std::count(px4.commands.begin(), px4.commands.end(), kMavCmdLand), 0);
  const auto events = mission.events();
  EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const ControllerEvent& e) { return e.text == "mode AUTO.LAND"; }));
}

TEST(Px4Mission, SilentOdometryHoldsAndThenLeavesTheDescentToPx4) {
  Px4Mission mission(hop(), 200, 2, 10);
  FakePx4 px4;
  const auto modes = fly(mission, px4, 12, 5);
  EXPECT_EQ(modes, (std::vector{FlightMode::waiting, FlightMode::mission, FlightMode::holding, FlightMode::descending}));
  EXPECT_EQ(std::count(px4.commands.begin(), px4.commands.end(), kMavCmdLand), 0) << "PX4 lands by itself";
}

TEST(Px4Mission, CountsResetsInFlight) {
  Px4Mission mission(hop(), 200, 2, 10);
  FakePx4 px4;
  px4.odometry.reset_counter = 3;
  fly(mission, px4, 5);
  ++px4.odometry.reset_counter;
  mission.receive({{2, 1}, 0, px4.odometry}, 5);
  mission.receive({{2, 197}, 0, OdometryMessage{}}, 5);  // the companion's own message
  EXPECT_EQ(mission.resets_in_flight(), 1);
}

}  // namespace px4_mission_test
}  // namespace fbvins
