// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include "fbvins/mavlink/vehicle_frames.hpp"
#include "fbvins/types/quality.hpp"

namespace fbvins {
namespace {

float to_float(double value) { return static_cast<float>(value); }

/// The upper triangle by rows.
std::array<float, 21> upper_triangle(const Mat6& covariance) {
  std::array<float, 21> values{};
  auto out = values.begin();
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) *out++ = to_float(covariance(row, column));
  return values;
}

/// The covariance of the rates is unknown.
Mat6 with_unknown_rates(const Mat3& velocity) {
  Mat6 both = Mat6::Constant(kMavUnknown);
  both.topLeftCorner<3, 3>() = velocity;
  return both;
}

std::uint8_t wrapped(std::uint32_t counter) { return static_cast<std::uint8_t>(counter); }

}  // namespace

std::int8_t odometry_quality(const Health& health, const Mat6& pose_covariance) {
  return health.state == HealthState::lost ? std::int8_t{-1} : static_cast<std::int8_t>(quality_percent(health, pose_covariance));
}

OdometryMessage odometry_message(const VehicleState& state, std::uint64_t time_usec) {
  OdometryMessage m;
  m.time_usec = time_usec;
  const Vec3 &p = state.T_LF.p, &v = state.v_LF_F, &w = state.w_LF_F;
  const Quat q = state.T_LF.q.normalized();
  m.x = to_float(p.x()), m.y = to_float(p.y()), m.z = to_float(p.z());
  m.q = {to_float(q.w()), to_float(q.x()), to_float(q.y()), to_float(q.z())};
  m.vx = to_float(v.x()), m.vy = to_float(v.y()), m.vz = to_float(v.z());
  m.rollspeed = to_float(w.x()), m.pitchspeed = to_float(w.y()), m.yawspeed = to_float(w.z());
  m.pose_covariance = upper_triangle(state.pose_covariance);
  m.velocity_covariance = upper_triangle(with_unknown_rates(state.velocity_covariance));
  m.reset_counter = wrapped(state.reset_counter);
  m.quality = odometry_quality(state.health, state.pose_covariance);
  return m;
}

OdometryMessage no_odometry_message(const Health& health, std::uint32_t reset_counter, std::uint64_t time_usec) {
  OdometryMessage m;
  m.time_usec = time_usec;
  m.x = m.y = m.z = m.vx = m.vy = m.vz = m.rollspeed = m.pitchspeed = m.yawspeed = kMavUnknown;
  m.q.fill(kMavUnknown);
  m.pose_covariance.fill(kMavUnknown);
  m.velocity_covariance.fill(kMavUnknown);
  m.reset_counter = wrapped(reset_counter);
  m.quality = health.state == HealthState::lost ? -1 : 0;
  return m;
}

VisionPositionMessage vision_position_message(const VehicleState& state, std::uint64_t time_usec) {
  VisionPositionMessage m;
  m.usec = time_usec;
  const Mat3 R = state.T_LF.R();
  m.x = to_float(state.T_LF.p.x()), m.y = to_float(state.T_LF.p.y()), m.z = to_float(state.T_LF.p.z());
  m.roll = to_float(std::atan2(R(2, 1), R(2, 2)));
  m.pitch = to_float(std::asin(std::clamp(-R(2, 0), -1.0, 1.0)));
  m.yaw = to_float(std::atan2(R(1, 0), R(0, 0)));
  m.covariance = upper_triangle(state.pose_covariance);
  m.reset_counter = wrapped(state.reset_counter);
  return m;
}

VisionSpeedMessage vision_speed_message(const VehicleState& state, std::uint64_t time_usec) {
  VisionSpeedMessage m;
  m.usec = time_usec;
  const Mat3 R_LF = state.T_LF.R();
  const Vec3 v = R_LF * state.v_LF_F;
  m.x = to_float(v.x()), m.y = to_float(v.y()), m.z = to_float(v.z());
  const Mat3 covariance = R_LF * state.velocity_covariance * R_LF.transpose();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      m.covariance[static_cast<std::size_t>(3 * row + column)] = to_float(covariance(row, column));
  m.reset_counter = wrapped(state.reset_counter);
  return m;
}

StatusTextMessage health_message(const Health& health) {
  const std::string sentence = "VIO " + to_sentence(health);
  switch (health.state) {
    case HealthState::good: return status_text(MavSeverity::notice, sentence);
    case HealthState::degraded: return status_text(MavSeverity::warning, sentence);
    case HealthState::lost: return status_text(MavSeverity::error, sentence);
    case HealthState::initialising: break;
  }
  return status_text(MavSeverity::info, sentence);
}

}  // namespace fbvins
