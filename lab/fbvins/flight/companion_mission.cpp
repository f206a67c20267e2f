// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/companion_mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace fbvins {
namespace {

constexpr double kTargets_hz = 50, kAskAgain_s = 1.0, kRefused_s = 30.0;
/// The flight controller's estimate is extrapolated by its velocity for at most this long.
constexpr double kCarried_s = 0.2;
constexpr std::uint8_t kArmedFlag = 128;  // MAV_MODE_FLAG_SAFETY_ARMED

double heading(const Quat& q) {
  const Vec3 nose = q * Vec3::UnitX();
  return std::atan2(nose.y(), nose.x());
}

}  // namespace

CompanionMission::CompanionMission(const Mission& mission, double rate_hz, int system_id, const char* name)
    : fence_(fence_of(mission)),
      dt_s_(1 / rate_hz),
      system_(static_cast<std::uint8_t>(system_id)),
      name_(name),
      guide_(mission, rate_hz) {}

void CompanionMission::say(double now_s, const std::string& text) {
  ControllerEvent& event = events_.emplace_back();
  event.t_s = now_s, event.text = text;
}

void CompanionMission::receive(const MavlinkFrame& frame, double now_s) {
  if (frame.from != MavlinkAddress{system_, 1}) return;
  if (const auto* beat = std::get_if<HeartbeatMessage>(&frame.message)) receive(*beat, now_s);
  else if (const auto* text = std::get_if<StatusTextMessage>(&frame.message))
    say(now_s, fmt::format("{}: {}", name_, std::string(text->text.data(), strnlen(text->text.data(), text->text.size()))));
  else if (const auto* ack = std::get_if<CommandAckMessage>(&frame.message); ack && ack->result != kMavResultAccepted)
    say(now_s, fmt::format("command {} refused ({})", ack->command, ack->result));
  hear(frame, now_s);
}

void CompanionMission::receive(const HeartbeatMessage& beat, double now_s) {
  const bool armed = (beat.base_mode & kArmedFlag) != 0;
  if (!heard_ || armed != armed_) say(now_s, fmt::format("{}armed", armed ? "" : "dis"));
  if (!heard_ || beat.custom_mode != mode_) say(now_s, fmt::format("mode {}", mode_name(beat.custom_mode)));
  heard_ = true;
  armed_ = armed;
  mode_ = beat.custom_mode;
}

void CompanionMission::note_reset(double now_s, const std::string& text) {
  say(now_s, text);
  if (in_flight()) ++resets_in_flight_;
}

/// The flight controller's estimate, extrapolated to now.
void CompanionMission::look(double now_s) {
  if (!estimate_) return;
  out_.estimate = *estimate_;
  const Pose<Local, BodyFlu> T_NV = estimate_->T_LV;
  const double since_s = std::clamp(now_s - estimate_s_, 0.0, kCarried_s);
  out_.estimate.v_LV = T_LN_.q * estimate_->v_LV;
  out_.estimate.T_LV = {T_LN_.q * T_NV.q, Vec3(T_LN_.q * T_NV.p + T_LN_.p + since_s * out_.estimate.v_LV)};
}

void CompanionMission::command(std::uint16_t number, std::array<float, 7> params, double now_s) {
  if (now_s < next_command_s_) return;
  next_command_s_ = now_s + kAskAgain_s;
  CommandMessage message;
  message.command = number;
  message.params = params;
  message.target_system = system_;
  outgoing_.emplace_back(message);
}

void CompanionMission::begin_asking(double now_s, const std::string& text) {
  ready_s_ = now_s;
  say(now_s, text);
  next_command_s_ = 0;
}

/// Setpoints are at the current position until the mission begins.
void CompanionMission::ask(double now_s) {
  if (!heard_) return;
  if (estimate_) out_.setpoint.p = out_.estimate.T_LV.p, out_.setpoint.yaw_rad = heading(out_.estimate.T_LV.q);
  prepare(now_s);
}

void CompanionMission::stand_here() {
  const Pose<Local, BodyFlu> standing = estimate_->T_LV;
  const Quat q_LN = so3_exp(Vec3(0, 0, -heading(standing.q)));
  T_LN_ = {q_LN, Vec3(-(q_LN * standing.p))};
}

void CompanionMission::take_off(double now_s) {
  flying_ = true;
  look(now_s);
  guide_.begin(out_.estimate.T_LV);
}

/// Before take-off. The vehicle may be armed, or be about to.
void CompanionMission::give_up(FlightReason reason, double now_s) {
  out_.mode = FlightMode::landed;
  out_.reason = reason;
  next_command_s_ = 0;
  if (ready_s_) command(kMavCmdArm, {0}, now_s);
}

void CompanionMission::guide(double now_s) {
  out_.mode = failsafe_.mode();
  out_.reason = failsafe_.reason();
  const bool by_itself = !follows(mode_) && !guide_.landing();
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
  if (const bool blind = out_.mode == FlightMode::descending; blind != blind_ && out_.mode != FlightMode::landed) {
    blind_ = blind;
    use_poses(!blind, now_s);
  }
  if (armed_ && guide_.landing() && !lands(mode_)) command(kMavCmdLand, {}, now_s);
  out_.step = guide_.step();
}

std::vector<MavlinkMessage> CompanionMission::update(const LivePose& pose, double now_s) {
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
    ask(now_s);
    if (flying_) out_.mode = FlightMode::mission;
    const bool refused = ready_s_ && now_s - *ready_s_ > kRefused_s;
    if (!flying_ && refused) give_up(FlightReason::flight_controller, now_s);
  } else if (wanted == FlightMode::landed) {
    give_up(failsafe_.reason(), now_s);
  }
  const bool streams = (flying_ || (ready_s_ && streams_early())) && out_.mode != FlightMode::landed && !guide_.landing();
  if (streams && now_s >= next_target_s_) {
    next_target_s_ = now_s + 1 / kTargets_hz;
    PositionTargetMessage target = target_message(out_.setpoint, T_LN_, static_cast<std::uint32_t>(std::max(0.0, 1e3 * now_s)));
    target.target_system = system_;
    outgoing_.emplace_back(target);
  }
  return std::exchange(outgoing_, {});
}

}  // namespace fbvins
