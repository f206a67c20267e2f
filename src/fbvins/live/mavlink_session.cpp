// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

namespace fbvins {
namespace {

constexpr Duration kTextEvery{500'000'000}, kPatience{3'000'000'000};
/// It takes an origin only when its EKF runs, ten seconds after its start.
constexpr Duration kOriginEvery{5'000'000'000};

Odometry odometry(const LivePose& pose) {
  Odometry o;
  o.t = pose.t;
  o.T_WB = pose.T_WB, o.v_WB = pose.v_WB, o.w_WB_B = pose.w_WB_B;
  o.pose_covariance = pose.pose_covariance, o.velocity_covariance = pose.velocity_covariance;
  o.health = pose.health, o.reset_counter = pose.reset_counter;
  return o;
}

}  // namespace

Result<std::optional<GlobalOriginMessage>> parse_mavlink_origin(const std::string& text) {
  if (text.empty()) return std::optional<GlobalOriginMessage>();
  std::istringstream in(text);
  double latitude = 0, longitude = 0, altitude_m = 0;
  char first = 0, second = 0;
  const bool read = static_cast<bool>(in >> latitude >> first >> longitude >> second >> altitude_m) && in.peek() == EOF &&
                    first == ',' && second == ',';
  if (!read || !(std::abs(latitude) <= 90) || !(std::abs(longitude) <= 180) || !(std::abs(altitude_m) <= 10'000))
    return Error{ErrorCode::invalid_argument,
                 fmt::format("live.mavlink.origin: '{}' is not LATITUDE,LONGITUDE,ALTITUDE in degrees and metres", text)};
  GlobalOriginMessage origin;
  origin.latitude = static_cast<std::int32_t>(std::lround(latitude * 1e7));
  origin.longitude = static_cast<std::int32_t>(std::lround(longitude * 1e7));
  origin.altitude = static_cast<std::int32_t>(std::lround(altitude_m * 1e3));
  return std::optional(origin);
}

MavlinkSession::MavlinkSession(const MavlinkOptions& options, std::unique_ptr<MavlinkSigner> signer)
    : options_(options),
      signer_(std::move(signer)),
      frames_(options.mounting),
      decoder_(signer_.get()),
      aiding_(options.sensors, options.mounting),
      peer_(options.system_id) {
  if (const auto origin = parse_mavlink_origin(options.origin)) origin_ = *origin;
}

void MavlinkSession::say(const MavlinkMessage& message, Frames& out) {
  const MavlinkAddress us{static_cast<std::uint8_t>(options_.system_id), static_cast<std::uint8_t>(options_.component_id)};
  out.push_back(encode_mavlink(message, us, sequence_++, signer_.get()));
}

bool MavlinkSession::may_send_poses(Time now) const { return options_.clock == MavlinkClock::own || peer_.clock_is_sure(now); }

Time MavlinkSession::their_time(Time host_t) const {
  return options_.clock == MavlinkClock::own ? host_t : host_t + clock().value();
}

std::uint64_t MavlinkSession::stamp_usec(Time host_t) const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(their_time(host_t).ns, 0) / 1000);
}

MavlinkSession::Frames MavlinkSession::take(const LivePose& pose) {
  Frames out;
  // A reading counts as due if it is early by less than a tenth of the output's period: their stamps jitter.
  if (!is_due(pose.host_t + Duration::from_seconds(0.1 / options_.rate_hz), Duration::from_seconds(1 / options_.rate_hz),
              next_pose_))
    return out;
  if (!may_send_poses(pose.host_t)) return ++withheld_, out;
  say_pose(pose, stamp_usec(pose.host_t), out);
  if (!out.empty()) ++poses_;
  return out;
}

void MavlinkSession::say_pose(const LivePose& pose, std::uint64_t t_usec, Frames& out) {
  const std::optional<VehicleState> state = frames_.state(odometry(pose));
  switch (options_.dialect) {
    case MavlinkDialect::px4: return say(odometry_for_px4(pose, state, t_usec), out);
    case MavlinkDialect::ardupilot:
      if (const auto message = odometry_for_ardupilot(state, t_usec)) say(*message, out);
      return;
    case MavlinkDialect::vision_estimate:
      if (!state) return;  // it has no message for a missing pose
      say(vision_position_message(*state, t_usec), out);
      say(vision_speed_message(*state, t_usec), out);
  }
}

OdometryMessage MavlinkSession::odometry_for_px4(const LivePose& pose, const std::optional<VehicleState>& state,
                                                 std::uint64_t t_usec) const {
  OdometryMessage message = state ? odometry_message(*state, t_usec)
                                  : no_odometry_message(pose.health, frames_.reset_counter(pose.reset_counter), t_usec);
  if (options_.frame == MavlinkFrameId::local_ned) message.frame_id = kMavFrameLocalNed;
  return message;
}

/// ArduPilot takes any message as a sign that vision is healthy, and with its default of VISO_QUAL_MIN, 0, a pose of unknown
/// quality as good; only EKF3 looks whether it is a number. It ignores other frames than LOCAL_FRD.
std::optional<OdometryMessage> MavlinkSession::odometry_for_ardupilot(const std::optional<VehicleState>& state,
                                                                      std::uint64_t t_usec) {
  if (state) return last_ = odometry_message(*state, t_usec);
  if (!last_) return std::nullopt;
  OdometryMessage failed = *last_;
  failed.time_usec = t_usec;
  failed.quality = -1;
  return failed;
}

MavlinkSession::Frames MavlinkSession::take(const LiveStatus& status, Time now) {
  health_ = status.health;
  had_pose_ |= status.health.has_pose();
  return tick(now);
}

/// PX4's documents name three states for odometry: active; critical where it works with low confidence; flight termination where
/// it has failed. A start that follows a failure is one until there is a pose again.
HeartbeatMessage MavlinkSession::heartbeat() const {
  HeartbeatMessage beat;
  switch (health_.value_or(Health{}).state) {
    case HealthState::good: beat.system_status = kMavStateActive; break;
    case HealthState::degraded: beat.system_status = kMavStateCritical; break;
    case HealthState::lost: beat.system_status = kMavStateTermination; break;
    case HealthState::initialising: beat.system_status = had_pose_ ? kMavStateTermination : kMavStateCalibrating; break;
  }
  return beat;
}

/// From the first pose on, until the flight controller says where its origin is.
void MavlinkSession::say_origin(Time now, Frames& out) {
  if (!origin_ || origin_is_known_ || !had_pose_ || !is_due(now, kOriginEvery, next_origin_)) return;
  GlobalOriginMessage origin = *origin_;
  origin.target_system = peer_.address()->system;
  say(origin, out);
}

std::string MavlinkSession::problem(Time now) const {
  if (!unsure_since_ || now - *unsure_since_ < kPatience) return {};
  if (!flight_controller_heard(now)) return "no flight controller is heard; poses are sent once its clock is known";
  if (clock().known())
    return "the flight controller's clock has changed or is not confirmed; poses are sent once it is known again";
  return "the flight controller does not answer TIMESYNC, and no pose is sent (live.mavlink.clock=own sends them without)";
}

MavlinkSession::Frames MavlinkSession::tick(Time now) {
  Frames out;
  if (may_send_poses(now)) unsure_since_.reset();
  else if (!unsure_since_) unsure_since_ = now;
  if (is_due(now, kHeartbeatEvery, next_heartbeat_)) say(heartbeat(), out);
  if (!flight_controller_heard(now)) {
    told_health_.reset();  // is sent again when it comes back
    origin_is_known_ = false;
    return out;
  }
  say_origin(now, out);
  for (const CommandMessage& request : aiding_.requests(*peer_.address(), now)) say(request, out);
  if (options_.clock == MavlinkClock::flight_controller)
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
  if (std::holds_alternative<KnownOriginMessage>(frame.message) && peer_.address() &&
      frame.from.system == peer_.address()->system)
    origin_is_known_ = true;
  if (peer_.address() && frame.from == *peer_.address() && peer_.clock_is_sure(now))
    if (auto reading = aiding_.read(frame.message, clock().value(), now)) readings_.push_back(*std::move(reading));
  const auto* sync = std::get_if<TimesyncMessage>(&frame.message);
  if (sync != nullptr && sync->tc1 == 0 && may_send_poses(now)) say(TimesyncMessage{their_time(now).ns, sync->ts1}, out);
}

void MavlinkSession::restart() {
  decoder_.restart();
  peer_.forget_questions();
  told_health_.reset();
}

}  // namespace fbvins
