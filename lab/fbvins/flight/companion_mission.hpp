// SPDX-License-Identifier: Apache-2.0
// The companion's part in a mission that a flight controller flies: when the odometry is good it has the vehicle armed and lets
// it follow the mission's setpoints; at its end it asks for a landing. What the flight controller does by itself is reported as
// FlightReason::flight_controller. Px4Mission and ArduPilotMission know how each is told. No I/O and no clock: messages and time
// are arguments. One owner.
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

class CompanionMission {
 public:
  CompanionMission(const CompanionMission&) = delete;
  CompanionMission& operator=(const CompanionMission&) = delete;
  virtual ~CompanionMission() = default;

  void receive(const MavlinkFrame& frame, double now_s);
  /// At every reading of the odometry's IMU. Returns the messages to send.
  std::vector<MavlinkMessage> update(const LivePose& pose, double now_s);

  const AutopilotOutput& output() const { return out_; }
  const std::vector<ControllerEvent>& events() const { return events_; }
  /// How often the flight controller's estimator reset between arming and landing.
  int resets_in_flight() const { return resets_in_flight_; }

 protected:
  CompanionMission(const Mission& mission, double rate_hz, int system_id, const char* name);

  /// The flight controller's other messages.
  virtual void hear(const MavlinkFrame& frame, double now_s) = 0;
  /// Sends what is missing until the vehicle can follow setpoints; then calls take_off(). Before there may be no estimate().
  virtual void prepare(double now_s) = 0;
  /// There are no poses any more in flight (false), or there are again.
  virtual void use_poses(bool /*use*/, double /*now_s*/) {}
  /// In the mode that follows our setpoints.
  virtual bool follows(std::uint32_t mode) const = 0;
  virtual bool lands(std::uint32_t mode) const = 0;
  virtual std::string mode_name(std::uint32_t mode) const = 0;
  /// Setpoints are sent before the vehicle follows them.
  virtual bool streams_early() const = 0;

  void say(double now_s, const std::string& text);
  /// At most one a second.
  void command(std::uint16_t number, std::array<float, 7> params, double now_s);
  void send(const MavlinkMessage& message) { outgoing_.push_back(message); }
  /// The flight controller's own estimate, in N.
  void hear_estimate(const VehicleEstimate& estimate, double t_s) { estimate_ = estimate, estimate_s_ = t_s; }
  void note_reset(double now_s, const std::string& text);
  /// Places L at the standing vehicle by the flight controller's estimate: heading and position only, as both frames have z up.
  void stand_here();
  void take_off(double now_s);

  bool heard() const { return heard_; }
  bool armed() const { return armed_; }
  std::uint32_t mode() const { return mode_; }
  std::uint8_t system() const { return system_; }
  const std::optional<VehicleEstimate>& estimate() const { return estimate_; }
  /// Since when prepare() asks; none before.
  std::optional<double> ready_s() const { return ready_s_; }
  void begin_asking(double now_s, const std::string& text);
  void command_at_once() { next_command_s_ = 0; }
  const AutopilotOutput& out() const { return out_; }

 private:
  void receive(const HeartbeatMessage& beat, double now_s);
  void look(double now_s);
  void ask(double now_s);
  void give_up(FlightReason reason, double now_s);
  void guide(double now_s);
  bool in_flight() const { return flying_ && out_.mode != FlightMode::landed; }

  Geofence fence_;
  double dt_s_;
  std::uint8_t system_;
  std::string name_;
  Guide guide_;
  Failsafe failsafe_;
  std::uint32_t reset_counter_ = 0;  ///< of the odometry
  // State reported by the flight controller.
  bool armed_ = false, heard_ = false;
  std::uint32_t mode_ = 0;
  std::optional<VehicleEstimate> estimate_;
  double estimate_s_ = 0;
  // State of the companion.
  Pose<Local, Px4Local> T_LN_;
  bool flying_ = false, blind_ = false;
  std::optional<double> ready_s_;
  double next_target_s_ = 0, next_command_s_ = 0;
  std::vector<MavlinkMessage> outgoing_;
  std::vector<ControllerEvent> events_;
  int resets_in_flight_ = 0;
  AutopilotOutput out_;
};

}  // namespace fbvins
