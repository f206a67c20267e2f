// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/position_controller.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {

Quat attitude_for(const Vec3& thrust, double yaw_rad) {
  const Vec3 z = thrust.norm() > 1e-9 ? Vec3(thrust.normalized()) : Vec3::UnitZ();
  const Vec3 side(-std::sin(yaw_rad), std::cos(yaw_rad), 0);
  Vec3 x = side.cross(z);
  x = x.norm() > 1e-6 ? Vec3(x.normalized()) : Vec3(std::cos(yaw_rad), std::sin(yaw_rad), 0);
  Mat3 R;
  R << x, z.cross(x), z;
  return Quat(R).normalized();
}

PositionController::PositionController(const PositionControlOptions& options, double rate_hz)
    : options_(options), dt_s_(1 / rate_hz), acceleration_(rate_hz, options.MPC_VELD_LP) {}

Vec3 PositionController::limited_velocity(const Vec3& v) const {
  Vec3 limited = v;
  const double across = v.head<2>().norm();
  if (across > options_.MPC_XY_VEL_MAX) limited.head<2>() *= options_.MPC_XY_VEL_MAX / across;
  limited.z() = std::clamp(v.z(), -options_.MPC_Z_VEL_MAX_DN, options_.MPC_Z_VEL_MAX_UP);
  return limited;
}

/// Limits tilt and thrust, with priority to the vertical component. Shares of full thrust, in L.
Vec3 PositionController::limited_thrust(Vec3 thrust) const {
  const double most = options_.MPC_THR_MAX;
  thrust.z() = std::clamp(thrust.z(), options_.MPC_THR_MIN, most);
  const double tilted = std::tan(options_.MPC_TILTMAX_AIR * std::numbers::pi / 180) * thrust.z();
  const double room = std::min(tilted, std::sqrt(std::max(0.0, most * most - thrust.z() * thrust.z())));
  const double across = thrust.head<2>().norm();
  if (across > room) thrust.head<2>() *= room / across;
  return thrust;
}

/// Anti-windup: tracking horizontally, clamping vertically.
void PositionController::integrate(const Vec3& error, const Vec3& asked, const Vec3& given) {
  const PositionControlOptions& o = options_;
  const Vec3 missing = asked - given;
  Vec3 e = error;
  if (missing.head<2>().norm() > 1e-6) e.head<2>() -= 2 / o.MPC_XY_VEL_P_ACC * missing.head<2>();
  if ((missing.z() > 1e-6 && e.z() > 0) || (missing.z() < -1e-6 && e.z() < 0)) e.z() = 0;
  integral_ += dt_s_ * e.cwiseProduct(Vec3(o.MPC_XY_VEL_I_ACC, o.MPC_XY_VEL_I_ACC, o.MPC_Z_VEL_I_ACC));
  integral_.z() = std::clamp(integral_.z(), -kSimGravity_mps2, kSimGravity_mps2);
}

AttitudeSetpoint PositionController::update(const VehicleEstimate& state, const PathSetpoint& setpoint) {
  const PositionControlOptions& o = options_;
  const Vec3 a_now = acceleration_(last_v_ ? Vec3((state.v_LV - *last_v_) / dt_s_) : Vec3(Vec3::Zero()));
  last_v_ = state.v_LV;

  const Vec3 P(o.MPC_XY_P, o.MPC_XY_P, o.MPC_Z_P);
  v_wanted_ = limited_velocity(setpoint.v + P.cwiseProduct(setpoint.p - state.T_LV.p));
  const Vec3 error = v_wanted_ - state.v_LV;
  const Vec3 vP(o.MPC_XY_VEL_P_ACC, o.MPC_XY_VEL_P_ACC, o.MPC_Z_VEL_P_ACC),
      vD(o.MPC_XY_VEL_D_ACC, o.MPC_XY_VEL_D_ACC, o.MPC_Z_VEL_D_ACC);
  a_wanted_ = setpoint.a + vP.cwiseProduct(error) + integral_ - vD.cwiseProduct(a_now - setpoint.a);

  const double share_per_mps2 = o.MPC_THR_HOVER / kSimGravity_mps2;
  const Vec3 asked = share_per_mps2 * (a_wanted_ + Vec3(0, 0, kSimGravity_mps2)), given = limited_thrust(asked);
  integrate(error, asked / share_per_mps2, given / share_per_mps2);
  AttitudeSetpoint out;
  out.q_LV = attitude_for(given, setpoint.yaw_rad);
  out.yaw_rate_radps = setpoint.yaw_rate_radps;
  out.thrust = given.dot(state.T_LV.q * Vec3::UnitZ());  // projection on the current body z axis
  out.thrust = std::clamp(out.thrust, o.MPC_THR_MIN, o.MPC_THR_MAX);
  return out;
}

AttitudeSetpoint PositionController::climb(double v_z_mps, double v_z_wanted_mps, double yaw_rad) {
  const PositionControlOptions& o = options_;
  const double share_per_mps2 = o.MPC_THR_HOVER / kSimGravity_mps2, error = v_z_wanted_mps - v_z_mps;
  v_wanted_ = Vec3(0, 0, v_z_wanted_mps);
  a_wanted_ = Vec3(0, 0, o.MPC_Z_VEL_P_ACC * error + integral_.z());
  const double asked = share_per_mps2 * (a_wanted_.z() + kSimGravity_mps2),
               given = std::clamp(asked, o.MPC_THR_MIN, o.MPC_THR_MAX);
  integral_.head<2>().setZero();
  integrate(Vec3(0, 0, error), Vec3(0, 0, asked / share_per_mps2), Vec3(0, 0, given / share_per_mps2));
  last_v_.reset();
  return {attitude_for(Vec3::UnitZ(), yaw_rad), 0, given};
}

}  // namespace fbvins
