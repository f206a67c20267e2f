// SPDX-License-Identifier: Apache-2.0
// The companion's part in a mission that a PX4 flies: when the odometry is good it streams setpoints, asks for OFFBOARD and arms;
// then it sends the mission's setpoints and, at its end, the command to land. What PX4 does by itself is reported as
// FlightReason::flight_controller. No I/O and no clock: messages and time are arguments. One owner.
//
//   Px4Mission mission(steps, 200, px4.system_id(), ahead_s);
//   mission.receive(frame, now_s);
//   for (const MavlinkMessage& message : mission.update(live_pose, now_s)) send(message);
//   log(mission.output());
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fbvins/flight/guide.hpp"
#include "fbvins/flight/px4_frames.hpp"
#include "fbvins/live/live_event.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

class Px4Mission {
 public:
  /// `ahead_s`: PX4's clock minus `now_s`.
  Px4Mission(const Mission& mission, double rate_hz, int system_id, double ahead_s);

  void receive(const MavlinkFrame& frame, double now_s);
  /// At every reading of the odometry's IMU. Returns the messages to send.
  std::vector<MavlinkMessage> update(const LivePose& pose, double now_s);

  const AutopilotOutput& output() const { return out_; }
  const std::vector<ControllerEvent>& events() const { return events_; }
  /// How often PX4's estimator reset between arming and landing.
  int resets_in_flight() const { return resets_in_flight_; }

 private:
  void receive(const HeartbeatMessage& beat, double now_s);
  void hear_odometry(const OdometryMessage& odometry, double now_s);
  void receive(const CommandAckMessage& ack, double now_s);
  void look(double now_s);
  void prepare(double now_s);
  void take_off(double now_s);
  void give_up(FlightReason reason, double now_s);
  void guide(double now_s);
  void command(std::uint16_t number, std::array<float, 7> params, double now_s);
  void say(double now_s, const std::string& text);
  bool in_flight() const { return flying_ && out_.mode != FlightMode::landed; }

  Geofence fence_;
  double dt_s_, ahead_s_;
  std::uint8_t system_;
  Guide guide_;
  Failsafe failsafe_;
  std::uint32_t reset_counter_ = 0;  ///< of the odometry
  // State reported by PX4.
  bool armed_ = false, heard_ = false;
  std::uint32_t px4_mode_ = 0;
  std::optional<OdometryMessage> odometry_;
  double odometry_s_ = 0;
  // State of the companion.
  Pose<Local, Px4Local> T_LN_;
  bool flying_ = false;
  double ready_s_ = 0, next_target_s_ = 0, next_command_s_ = 0;
  std::vector<MavlinkMessage> outgoing_;
  std::vector<ControllerEvent> events_;
  int resets_in_flight_ = 0;
  AutopilotOutput out_;
};

}  // namespace fbvins
