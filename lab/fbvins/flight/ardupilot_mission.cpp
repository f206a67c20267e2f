// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/ardupilot_mission.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace fbvins {
namespace {

constexpr float kEstimate_us = 10'000;
constexpr double kTellAgain_s = 1.0;
/// Copter's modes.
constexpr std::uint32_t kGuided = 4, kLand = 9;
constexpr float kUseCustomMode = 1;  // MAV_MODE_FLAG
/// Commanded height of the take-off, and the height from which setpoints are followed.
constexpr float kTakeOff_m = 0.4F;
constexpr double kInTheAir_m = 0.12, kTakeOffAgain_s = 4.0;
/// Sets of EK3_SRCn parameters.
constexpr float kWithVision = 1, kWithoutVision = 2;
/// Anywhere: without GPS only the local frame matters. Degrees times 1e7, mm.
constexpr std::int32_t kLatitude = 474'000'000, kLongitude = 85'000'000, kAltitude_mm = 400'000;
/// Two estimates that differ by so much more than the velocity explains are a reset.
constexpr double kJump_m = 0.1;

Vec3 position_of(const LocalPositionMessage& m) { return flu_to_frd(Vec3(m.x, m.y, m.z)); }
Vec3 velocity_of(const LocalPositionMessage& m) { return flu_to_frd(Vec3(m.vx, m.vy, m.vz)); }

}  // namespace

bool ArduPilotMission::follows(std::uint32_t mode) const { return mode == kGuided; }
bool ArduPilotMission::lands(std::uint32_t mode) const { return mode == kLand; }

std::string ArduPilotMission::mode_name(std::uint32_t mode) const {
  constexpr const char* kNames[] = {"STABILIZE", "ACRO", "ALT_HOLD", "AUTO",   "GUIDED",
                                    "LOITER",    "RTL",  "CIRCLE",   "mode 8", "LAND"};
  return mode < std::size(kNames) ? kNames[mode] : fmt::format("mode {}", mode);
}

void ArduPilotMission::hear(const MavlinkFrame& frame, double now_s) {
  if (const auto* attitude = std::get_if<AttitudeQuaternionMessage>(&frame.message)) attitude_ = *attitude;
  else if (const auto* position = std::get_if<LocalPositionMessage>(&frame.message)) hear_position(*position, now_s);
}

void ArduPilotMission::hear_position(const LocalPositionMessage& position, double now_s) {
  if (!attitude_ || !std::isfinite(position.x)) return;
  if (position_) {
    const double dt_s = 1e-3 * (static_cast<double>(position.time_boot_ms) - static_cast<double>(position_->time_boot_ms));
    const Vec3 jump = position_of(position) - position_of(*position_) - dt_s * velocity_of(position);
    if (jump.norm() > kJump_m) note_reset(now_s, fmt::format("EKF3 moved its estimate by {:.2f} m", jump.norm()));
  }
  position_ = position;
  VehicleEstimate estimate;
  const AttitudeQuaternionMessage& a = *attitude_;
  estimate.T_LV = {flu_to_frd(Quat(a.q1, a.q2, a.q3, a.q4).normalized()), position_of(position)};
  estimate.v_LV = velocity_of(position);
  estimate.w_LV_V = flu_to_frd(Vec3(a.rollspeed, a.pitchspeed, a.yawspeed));
  hear_estimate(estimate, 1e-3 * static_cast<double>(position.time_boot_ms) - ahead_s_);
}

/// EKF3 has a position once it fuses vision and knows where on the Earth that is.
void ArduPilotMission::ask_for_estimate(double now_s) {
  if (now_s < next_origin_s_) return;
  next_origin_s_ = now_s + kTellAgain_s;
  GlobalOriginMessage origin;
  origin.latitude = kLatitude, origin.longitude = kLongitude, origin.altitude = kAltitude_mm, origin.target_system = system();
  send(origin);
  for (const std::uint32_t id : {AttitudeQuaternionMessage::kId, LocalPositionMessage::kId}) {
    CommandMessage interval;
    interval.command = kMavCmdSetMessageInterval;
    interval.params = {static_cast<float>(id), kEstimate_us};
    interval.target_system = system();
    send(interval);
  }
}

void ArduPilotMission::leave_the_ground(double now_s) {
  const double z_m = estimate()->T_LV.p.z();
  if (!standing_z_m_) {
    stand_here();
    standing_z_m_ = z_m;
  }
  if (z_m - *standing_z_m_ > kInTheAir_m) return take_off(now_s);
  if (now_s < next_take_off_s_) return;
  next_take_off_s_ = now_s + kTakeOffAgain_s;
  command_at_once();
  command(kMavCmdTakeOff, {0, 0, 0, 0, 0, 0, kTakeOff_m}, now_s);
}

void ArduPilotMission::prepare(double now_s) {
  if (!ready_s()) begin_asking(now_s, "the odometry is good: sets the origin, asks for GUIDED, then arms");
  if (!estimate()) ask_for_estimate(now_s);
  else if (!follows(mode())) command(kMavCmdSetMode, {kUseCustomMode, static_cast<float>(kGuided)}, now_s);
  else if (!armed()) command(kMavCmdArm, {1}, now_s);
  else leave_the_ground(now_s);
}

/// Without poses EKF3 would go on with its IMU's position for seconds: the second set of sources has none.
void ArduPilotMission::use_poses(bool use, double now_s) {
  say(now_s, use ? "poses are back: first set of sources" : "no poses: second set of sources, and down");
  CommandMessage sources;
  sources.command = kMavCmdSetEkfSourceSet;
  sources.params = {use ? kWithVision : kWithoutVision};
  sources.target_system = system();
  send(sources);
  command_at_once();
  if (!use) command(kMavCmdLand, {}, now_s);
}

}  // namespace fbvins
