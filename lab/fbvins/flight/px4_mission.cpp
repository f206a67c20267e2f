// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace fbvins {
namespace {

constexpr double kTargets_hz = 50, kStreamedBefore_s = 1.0, kAskAgain_s = 1.0, kRefused_s = 30.0;
constexpr double kOdometry_us = 10'000;
/// PX4's estimate is extrapolated by its velocity for at most this long.
constexpr double kCarried_s = 0.2;
constexpr std::uint8_t kArmedFlag = 128, kCustomModeFlag = 1;  // MAV_MODE_FLAG
// PX4's main modes, and the sub-mode of AUTO.
constexpr std::uint32_t kOffboard = 6, kAuto = 4, kAutoLand = 6;

std::uint32_t main_mode(std::uint32_t custom_mode) { return custom_mode >> 16 & 0xff; }
std::uint32_t sub_mode(std::uint32_t custom_mode) { return custom_mode >> 24; }

bool landing(std::uint32_t mode) { return main_mode(mode) == kAuto && sub_mode(mode) == kAutoLand; }

std::string mode_name(std::uint32_t mode) {
  constexpr const char *kMain[] = {"", "MANUAL", "ALTCTL", "POSCTL", "AUTO", "ACRO", "OFFBOARD", "STABILIZED"},
                       *kSub[] = {"", "READY", "TAKEOFF", "LOITER", "MISSION", "RTL", "LAND"};
  const std::uint32_t main = main_mode(mode), sub = sub_mode(mode);
  if (main == kAuto && sub < std::size(kSub)) return fmt::format("AUTO.{}", kSub[sub]);
  return main < std::size(kMain) ? kMain[main] : fmt::format("mode {}", main);
}

double heading(const Quat& q) {
  const Vec3 nose = q * Vec3::UnitX();
  return std::atan2(nose.y(), nose.x());
}

bool finite(const OdometryMessage& m) {
  return std::isfinite(m.x) && std::isfinite(m.y) && std::isfinite(m.z) && std::isfinite(m.q[0]) && std::isfinite(m.vx);
}

}  // namespace

Px4Mission::Px4Mission(const Mission& mission, double rate_hz, int system_id, double ahead_s)
    : fence_(fence_of(mission)),
      dt_s_(1 / rate_hz),
      ahead_s_(ahead_s),
      system_(static_cast<std::uint8_t>(system_id)),
      guide_(mission, rate_hz) {}

void Px4Mission::say(double now_s, const std::string& text) {
  ControllerEvent& event = events_.emplace_back();
  event.t_s = now_s, event.text = text;
}

void Px4Mission::receive(const MavlinkFrame& frame, double now_s) {
  if (frame.from != MavlinkAddress{system_, 1}) return;
  if (const auto* beat = std::get_if<HeartbeatMessage>(&frame.message)) receive(*beat, now_s);
  else if (const auto* odometry = std::get_if<OdometryMessage>(&frame.message)) hear_odometry(*odometry, now_s);
  else if (const auto* ack = std::get_if<CommandAckMessage>(&frame.message)) receive(*ack, now_s);
  else if (const auto* text = std::get_if<StatusTextMessage>(&frame.message))
    say(now_s, fmt::format("PX4: {}", std::string(text->text.data(), strnlen(text->text.data(), text->text.size()))));
}

void Px4Mission::receive(const HeartbeatMessage& beat, double now_s) {
  const bool armed = (beat.base_mode & kArmedFlag) != 0;
  if (!heard_ || armed != armed_) say(now_s, fmt::format("{}armed", armed ? "" : "dis"));
  if (!heard_ || beat.custom_mode != px4_mode_) say(now_s, fmt::format("mode {}", mode_name(beat.custom_mode)));
  heard_ = true;
  armed_ = armed;
  px4_mode_ = beat.custom_mode;
}

void Px4Mission::hear_odometry(const OdometryMessage& odometry, double now_s) {
  if (odometry_ && odometry.reset_counter != odometry_->reset_counter) {
    say(now_s, fmt::format("EKF2 reset its estimate ({})", odometry.reset_counter));
    if (in_flight()) ++resets_in_flight_;
  }
  odometry_ = odometry;
  odometry_s_ = 1e-6 * static_cast<double>(odometry.time_usec) - ahead_s_;
}

void Px4Mission::receive(const CommandAckMessage& ack, double now_s) {
  if (ack.result != kMavResultAccepted) say(now_s, fmt::format("command {} refused ({})", ack.command, ack.result));
}

/// PX4's estimate, extrapolated to now.
void Px4Mission::look(double now_s) {
  if (!odometry_ || !finite(*odometry_)) return;
  out_.estimate = estimate_of(*odometry_);
  const Pose<Local, BodyFlu> T_NV = out_.estimate.T_LV;
  const double since_s = std::clamp(now_s - odometry_s_, 0.0, kCarried_s);
  out_.estimate.v_LV = T_LN_.q * out_.estimate.v_LV;
  out_.estimate.T_LV = {T_LN_.q * T_NV.q, Vec3(T_LN_.q * T_NV.p + T_LN_.p + since_s * out_.estimate.v_LV)};
}

void Px4Mission::command(std::uint16_t number, std::array<float, 7> params, double now_s) {
  if (now_s < next_command_s_) return;
  next_command_s_ = now_s + kAskAgain_s;
  CommandMessage message;
  message.command = number;
  message.params = params;
  message.target_system = system_;
  outgoing_.push_back(message);
}

/// Streams setpoints at the current position, then asks for OFFBOARD, then arms.
void Px4Mission::prepare(double now_s) {
  if (!heard_ || !odometry_ || !finite(*odometry_)) return;
  if (ready_s_ == 0) {
    ready_s_ = now_s;
    say(now_s, "the odometry is good: asks for OFFBOARD, then arms");
    next_command_s_ = 0;
    command(kMavCmdSetMessageInterval, {static_cast<float>(OdometryMessage::kId), kOdometry_us}, now_s);
  }
  out_.setpoint.p = out_.estimate.T_LV.p;
  out_.setpoint.yaw_rad = heading(out_.estimate.T_LV.q);
  if (now_s - ready_s_ < kStreamedBefore_s) return;
  const bool offboard = main_mode(px4_mode_) == kOffboard;
  if (offboard && armed_) return take_off(now_s);
  if (!offboard) command(kMavCmdSetMode, {kCustomModeFlag, kOffboard}, now_s);
  else command(kMavCmdArm, {1}, now_s);
}

/// Places L at the standing vehicle by PX4's estimate: heading and position only, as both frames have z up.
void Px4Mission::take_off(double now_s) {
  const Pose<Local, BodyFlu> standing = estimate_of(*odometry_).T_LV;
  const Quat q_LN = so3_exp(Vec3(0, 0, -heading(standing.q)));
  T_LN_ = {q_LN, Vec3(-(q_LN * standing.p))};
  flying_ = true;
  look(now_s);
  guide_.begin(out_.estimate.T_LV);
}

/// Before take-off. PX4 may be armed, or be about to.
void Px4Mission::give_up(FlightReason reason, double now_s) {
  out_.mode = FlightMode::landed;
  out_.reason = reason;
  next_command_s_ = 0;
  if (ready_s_ > 0) command(kMavCmdArm, {0}, now_s);
}

void Px4Mission::guide(double now_s) {
  out_.mode = failsafe_.mode();
  out_.reason = failsafe_.reason();
  const bool by_itself = main_mode(px4_mode_) != kOffboard && !guide_.landing();
  if (!armed_) {
    out_.mode = FlightMode::landed;
    if (out_.reason == FlightReason::none && !guide_.landing()) out_.reason = FlightReason::flight_controller;
  } else if (by_itself) {
    out_.reason = FlightReason::flight_controller;
    if (out_.mode != FlightMode::descending) out_.mode = FlightMode::landing;
  } else if (out_.mode == FlightMode::mission || out_.mode == FlightMode::holding) {
    out_.setpoint = guide_.next(out_.mode == FlightMode::holding ? 0 : 1, out_.estimate.T_LV.p);
  } else if (out_.mode == FlightMode::landing) {
    guide_.land_here();
  }
  if (armed_ && guide_.landing() && !landing(px4_mode_)) command(kMavCmdLand, {}, now_s);
  out_.step = guide_.step();
}

std::vector<MavlinkMessage> Px4Mission::update(const LivePose& pose, double now_s) {
  outgoing_.clear();
  out_.t = pose.t;
  out_.health = pose.health;
  out_.estimate_age_s = pose.estimate_t.ns > 0 ? (pose.t - pose.estimate_t).seconds() : 0;
  if (out_.mode == FlightMode::landed) return {};
  look(now_s);

  FlightCondition seen{.health = pose.health, .estimate_age_s = out_.estimate_age_s};
  seen.restarted = flying_ && pose.health.has_pose() && pose.reset_counter != reset_counter_;
  if (pose.health.has_pose()) reset_counter_ = pose.reset_counter;
  seen.landing = guide_.landing();
  seen.on_ground = !flying_ || !armed_;
  if (flying_) {
    seen.off_path_m = (out_.estimate.T_LV.p - out_.setpoint.p).norm();
    seen.outside_fence = !fence_.contains(out_.estimate.T_LV.p) && !guide_.landing() && guide_.step() > 0;
  }
  const FlightMode wanted = failsafe_.update(seen, dt_s_);
  if (flying_) {
    guide(now_s);
  } else if (wanted == FlightMode::mission) {
    prepare(now_s);
    if (flying_) out_.mode = FlightMode::mission;
    const bool refused = ready_s_ > 0 && now_s - ready_s_ > kRefused_s;
    if (!flying_ && refused) give_up(FlightReason::flight_controller, now_s);
  } else if (wanted == FlightMode::landed) {
    give_up(failsafe_.reason(), now_s);
  }
  const bool streams = ready_s_ > 0 && out_.mode != FlightMode::landed && !guide_.landing();
  if (streams && now_s >= next_target_s_) {
    next_target_s_ = now_s + 1 / kTargets_hz;
    PositionTargetMessage target = target_message(out_.setpoint, T_LN_, static_cast<std::uint32_t>(std::max(0.0, 1e3 * now_s)));
    target.target_system = system_;
    outgoing_.emplace_back(target);
  }
  return std::exchange(outgoing_, {});
}

}  // namespace fbvins
