// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_mission.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace fbvins {
namespace {

constexpr double kStreamedBefore_s = 1.0;
constexpr double kOdometry_us = 10'000;
constexpr std::uint8_t kCustomModeFlag = 1;  // MAV_MODE_FLAG
// PX4's main modes, and the sub-mode of AUTO.
constexpr std::uint32_t kOffboard = 6, kAuto = 4, kAutoLand = 6;

std::uint32_t main_mode(std::uint32_t custom_mode) { return custom_mode >> 16 & 0xff; }
std::uint32_t sub_mode(std::uint32_t custom_mode) { return custom_mode >> 24; }

bool finite(const OdometryMessage& m) {
  return std::isfinite(m.x) && std::isfinite(m.y) && std::isfinite(m.z) && std::isfinite(m.q[0]) && std::isfinite(m.vx);
}

}  // namespace

bool Px4Mission::follows(std::uint32_t mode) const { return main_mode(mode) == kOffboard; }
bool Px4Mission::lands(std::uint32_t mode) const { return main_mode(mode) == kAuto && sub_mode(mode) == kAutoLand; }

std::string Px4Mission::mode_name(std::uint32_t mode) const {
  constexpr const char *kMain[] = {"", "MANUAL", "ALTCTL", "POSCTL", "AUTO", "ACRO", "OFFBOARD", "STABILIZED"},
                       *kSub[] = {"", "READY", "TAKEOFF", "LOITER", "MISSION", "RTL", "LAND"};
  const std::uint32_t main = main_mode(mode), sub = sub_mode(mode);
  if (main == kAuto && sub < std::size(kSub)) return fmt::format("AUTO.{}", kSub[sub]);
  return main < std::size(kMain) ? kMain[main] : fmt::format("mode {}", main);
}

void Px4Mission::hear(const MavlinkFrame& frame, double now_s) {
  const auto* odometry = std::get_if<OdometryMessage>(&frame.message);
  if (odometry == nullptr) return;
  if (ekf_resets_ && odometry->reset_counter != *ekf_resets_)
    note_reset(now_s, fmt::format("EKF2 reset its estimate ({})", odometry->reset_counter));
  ekf_resets_ = odometry->reset_counter;
  if (finite(*odometry)) hear_estimate(estimate_of(*odometry), 1e-6 * static_cast<double>(odometry->time_usec) - ahead_s_);
}

/// Streams setpoints at the current position, then asks for OFFBOARD, then arms.
void Px4Mission::prepare(double now_s) {
  if (!estimate()) return;
  if (!ready_s()) {
    begin_asking(now_s, "the odometry is good: asks for OFFBOARD, then arms");
    command(kMavCmdSetMessageInterval, {static_cast<float>(OdometryMessage::kId), kOdometry_us}, now_s);
  }
  if (now_s - *ready_s() < kStreamedBefore_s) return;
  if (follows(mode()) && armed()) {
    stand_here();
    take_off(now_s);
  } else if (!follows(mode())) {
    command(kMavCmdSetMode, {kCustomModeFlag, kOffboard}, now_s);
  } else {
    command(kMavCmdArm, {1}, now_s);
  }
}

}  // namespace fbvins
