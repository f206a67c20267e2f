// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_session.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr Duration kHeartbeatEvery{1'000'000'000}, kTextEvery{500'000'000};

Odometry odometry(const LivePose& pose) {
  Odometry o;
  o.t = pose.t;
  o.T_WB = pose.T_WB, o.v_WB = pose.v_WB, o.w_WB_B = pose.w_WB_B;
  o.pose_covariance = pose.pose_covariance, o.velocity_covariance = pose.velocity_covariance;
  o.health = pose.health, o.reset_counter = pose.reset_counter;
  return o;
}

}  // namespace

MavlinkSession::MavlinkSession(const MavlinkOptions& options)
    : options_(options), frames_(options.mounting), peer_(options.system_id) {}

void MavlinkSession::say(const MavlinkMessage& message, Frames& out) {
  const MavlinkAddress us{static_cast<std::uint8_t>(options_.system_id), static_cast<std::uint8_t>(options_.component_id)};
  out.push_back(encode_mavlink(message, us, sequence_++));
}

std::uint64_t MavlinkSession::stamp_usec(Time host_t) const {
  const Time t = clock().known() ? host_t + clock().value() : host_t;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(t.ns, 0) / 1000);
}

MavlinkSession::Frames MavlinkSession::take(const LivePose& pose) {
  Frames out;
  // A reading counts as due if it is early by less than a tenth of the output's period: their stamps jitter.
  if (!is_due(pose.host_t + Duration::from_seconds(0.1 / options_.rate_hz), Duration::from_seconds(1 / options_.rate_hz),
              next_pose_))
    return out;
  const std::optional<VehicleState> state = frames_.state(odometry(pose));
  const std::uint64_t t_usec = stamp_usec(pose.host_t);
  if (options_.dialect == MavlinkDialect::ardupilot) {
    if (!state) return out;  // this dialect has no message for a missing pose
    say(vision_position_message(*state, t_usec), out);
    say(vision_speed_message(*state, t_usec), out);
  } else {
    say(state ? odometry_message(*state, t_usec) : no_odometry_message(pose.health, pose.reset_counter, t_usec), out);
  }
  ++poses_;
  return out;
}

MavlinkSession::Frames MavlinkSession::take(const LiveStatus& status, Time now) {
  health_ = status.health;
  return tick(now);
}

HeartbeatMessage MavlinkSession::heartbeat() const {
  constexpr std::uint8_t calibrating = 2, active = 4, critical = 5;  // MAV_STATE
  HeartbeatMessage beat;
  const Health health = health_.value_or(Health{});
  beat.system_status = health.has_pose() ? active : health.state == HealthState::lost ? critical : calibrating;
  return beat;
}

MavlinkSession::Frames MavlinkSession::tick(Time now) {
  Frames out;
  if (is_due(now, kHeartbeatEvery, next_heartbeat_)) say(heartbeat(), out);
  if (!flight_controller_heard(now)) {
    told_health_.reset();  // is sent again when it comes back
    return out;
  }
  if (const auto question = peer_.question(now)) say(*question, out);
  if (health_ && told_health_ != health_ && is_due(now, kTextEvery, next_text_)) {
    told_health_ = health_;
    say(health_message(*health_), out);
  }
  return out;
}

MavlinkSession::Frames MavlinkSession::receive(std::span<const std::uint8_t> bytes, Time now) {
  Frames out;
  for (const MavlinkFrame& frame : decoder_.push(bytes)) receive(frame, now, out);
  return out;
}

void MavlinkSession::receive(const MavlinkFrame& frame, Time now, Frames& out) {
  if (frame.from.system == options_.system_id && frame.from.component == options_.component_id) return;  // our own, sent back
  peer_.hear(frame, now);
  const auto* sync = std::get_if<TimesyncMessage>(&frame.message);
  if (sync != nullptr && sync->tc1 == 0 && clock().known()) say(TimesyncMessage{(now + clock().value()).ns, sync->ts1}, out);
}

void MavlinkSession::restart() {
  decoder_ = MavlinkDecoder();
  peer_.forget_questions();
  told_health_.reset();
}

}  // namespace fbvins
