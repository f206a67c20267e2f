// SPDX-License-Identifier: Apache-2.0
// The companion's part with a fake ArduCopter that obeys at once and follows setpoints exactly once it is in the air.
#include "fbvins/flight/ardupilot_mission.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace fbvins {
namespace ardupilot_mission_test {

constexpr std::uint32_t kGuidedMode = 4, kLandMode = 9;
constexpr double kAhead_s = 20;

Mission hop() { return *parse_mission("steps:\n  - takeoff: 0.5\n  - hold: 1\n  - goto: [0.5, 0, 0.5]\n  - land\n", "hop.yaml"); }

struct FakeCopter {
  bool knows_origin = false, ignores_take_off = false;
  HeartbeatMessage beat{.autopilot = 3};
  LocalPositionMessage position;
  std::vector<std::uint16_t> commands;
  std::vector<float> sources;
  int early_targets = 0;
  float height_m = 0;  ///< of the take-off that it was sent
  double landed_at_s = 0;

  void take(const MavlinkMessage& message, double now_s) {
    if (std::holds_alternative<GlobalOriginMessage>(message)) knows_origin = true;
    if (const auto* target = std::get_if<PositionTargetMessage>(&message)) {
      if (height_m == 0) ++early_targets;
      else position.x = target->x, position.y = target->y, position.z = target->z;
    }
    const auto* command = std::get_if<CommandMessage>(&message);
    if (command == nullptr || command->command == kMavCmdSetMessageInterval) return;
    commands.push_back(command->command);
    if (command->command == kMavCmdSetMode) beat.custom_mode = kGuidedMode;
    if (command->command == kMavCmdArm) beat.base_mode = command->params[0] > 0 ? 128 : 0;
    if (command->command == kMavCmdTakeOff && !ignores_take_off) height_m = command->params[6];
    if (command->command == kMavCmdSetEkfSourceSet) sources.push_back(command->params[0]);
    if (command->command == kMavCmdLand) beat.custom_mode = kLandMode, landed_at_s = now_s + 2;
  }
  void go_on(double now_s) {
    if (height_m > 0 && position.z > -0.2F) position.z -= 0.002F;
    if (landed_at_s > 0 && now_s > landed_at_s) beat.base_mode = 0;
    position.time_boot_ms = static_cast<std::uint32_t>(1e3 * (now_s + kAhead_s));
  }
};

std::vector<FlightMode> fly(ArduPilotMission& mission, FakeCopter& copter, double seconds, double odometry_ends_s = 1e9) {
  std::vector<FlightMode> modes;
  for (int i = 0; i < 200 * seconds; ++i) {
    const double now_s = i / 200.0;
    LivePose pose;
    pose.t = Time{1'000'000'000} + Duration::from_seconds(now_s);
    pose.estimate_t = std::min(pose.t, Time{1'000'000'000} + Duration::from_seconds(odometry_ends_s));
    pose.health = {HealthState::good, HealthReason::none};
    copter.go_on(now_s);
    if (copter.knows_origin) {
      mission.receive({{1, 1}, 0, AttitudeQuaternionMessage{}}, now_s);
      mission.receive({{1, 1}, 0, copter.position}, now_s);
    }
    if (i % 20 == 0) mission.receive({{1, 1}, 0, copter.beat}, now_s);
    for (const MavlinkMessage& message : mission.update(pose, now_s)) copter.take(message, now_s);
    if (modes.empty() || modes.back() != mission.output().mode) modes.push_back(mission.output().mode);
  }
  return modes;
}

TEST(ArduPilotMission, SetsTheOriginArmsTakesOffFliesAndLands) {
  ArduPilotMission mission(hop(), 200, 1, kAhead_s);
  FakeCopter copter;
  copter.position.x = 4, copter.position.z = -0.05F;
  const auto modes = fly(mission, copter, 40);
  EXPECT_EQ(modes, (std::vector{FlightMode::waiting, FlightMode::mission, FlightMode::landing, FlightMode::landed}));
  EXPECT_EQ(mission.output().reason, FlightReason::none);
  EXPECT_EQ(copter.commands, (std::vector{kMavCmdSetMode, kMavCmdArm, kMavCmdTakeOff, kMavCmdLand}));
  EXPECT_EQ(copter.early_targets, 0) << "GUIDED would not take off";
  EXPECT_NEAR(copter.position.x, 4.5, 0.01);
  EXPECT_NEAR(copter.position.z, -0.55, 0.01) << "heights count from where it stood";
  EXPECT_TRUE(copter.sources.empty());
}

TEST(ArduPilotMission, GivesUpIfItDoesNotTakeOff) {
  ArduPilotMission mission(hop(), 200, 1, kAhead_s);
  FakeCopter copter;
  copter.ignores_take_off = true;
  EXPECT_EQ(fly(mission, copter, 45), (std::vector{FlightMode::waiting, FlightMode::landed}));
  EXPECT_EQ(mission.output().reason, FlightReason::flight_controller);
  EXPECT_EQ(copter.beat.base_mode, 0) << "disarmed";
  EXPECT_GT(std::count(copter.commands.begin(), copter.commands.end(), kMavCmdTakeOff), 3);
}

TEST(ArduPilotMission, WithoutPosesItTakesTheSecondSourcesAndLands) {
  ArduPilotMission mission(hop(), 200, 1, kAhead_s);
  FakeCopter copter;
  const auto modes = fly(mission, copter, 20, 6);
  EXPECT_EQ(modes, (std::vector{FlightMode::waiting, FlightMode::mission, FlightMode::holding, FlightMode::descending,
                                FlightMode::landed}));
  EXPECT_EQ(mission.output().reason, FlightReason::lost);
  EXPECT_EQ(copter.sources, std::vector<float>{2});
  EXPECT_EQ(copter.commands.back(), kMavCmdLand);
}

TEST(ArduPilotMission, AJumpOfItsEstimateIsAReset) {
  ArduPilotMission mission(hop(), 200, 1, kAhead_s);
  FakeCopter copter;
  fly(mission, copter, 7);
  EXPECT_EQ(mission.resets_in_flight(), 0);
  copter.position.time_boot_ms += 10;
  copter.position.y += 0.3F;
  mission.receive({{1, 1}, 0, copter.position}, 7.01);
  EXPECT_EQ(mission.resets_in_flight(), 1);
  copter.position.x = std::numeric_limits<float>::quiet_NaN();
  mission.receive({{1, 1}, 0, copter.position}, 7.02);
  EXPECT_TRUE(mission.output().estimate.T_LV.p.allFinite());
}

}  // namespace ardupilot_mission_test
}  // namespace fbvins
