// SPDX-License-Identifier: Apache-2.0
// The outer loops of the cascade: position to velocity (P), velocity to acceleration (PID with anti-windup), acceleration to an
// attitude and a thrust. Like PX4's mc_pos_control, in L instead of NED. One owner.
//
//   PositionController position(options, 200);
//   AttitudeSetpoint wanted = position.update(state, setpoint);
#pragma once

#include <optional>

#include "fbvins/flight/control_filters.hpp"
#include "fbvins/flight/control_options.hpp"
#include "fbvins/sim/quadrotor.hpp"

namespace fbvins {

/// The mission's frame L: origin and x axis are the vehicle's position and heading before take-off; z is up as estimated.
struct Local {};

/// The vehicle's estimated state.
struct VehicleEstimate {
  Pose<Local, BodyFlu> T_LV;
  Vec3 v_LV = Vec3::Zero();    ///< m/s, in L
  Vec3 w_LV_V = Vec3::Zero();  ///< rad/s, in V
};

/// A setpoint on a smooth path.
struct PathSetpoint {
  Vec3 p = Vec3::Zero();  ///< m, in L
  Vec3 v = Vec3::Zero();  ///< m/s
  Vec3 a = Vec3::Zero();  ///< m/s^2
  double yaw_rad = 0, yaw_rate_radps = 0;
};

struct AttitudeSetpoint {
  Quat q_LV = Quat::Identity();
  double yaw_rate_radps = 0;
  double thrust = 0;  ///< along the vehicle's z axis, as a share of full thrust
};

class PositionController {
 public:
  PositionController(const PositionControlOptions& options, double rate_hz);

  AttitudeSetpoint update(const VehicleEstimate& state, const PathSetpoint& setpoint);
  /// Controls the vertical speed at level attitude: for flight without a position.
  AttitudeSetpoint climb(double v_z_mps, double v_z_wanted_mps, double yaw_rad);
  void reset() { integral_.setZero(); }

  const Vec3& velocity_setpoint() const { return v_wanted_; }
  const Vec3& acceleration_setpoint() const { return a_wanted_; }

 private:
  Vec3 limited_velocity(const Vec3& v) const;
  Vec3 limited_thrust(Vec3 thrust) const;
  void integrate(const Vec3& error, const Vec3& asked, const Vec3& given);

  PositionControlOptions options_;
  double dt_s_;
  LagFilter acceleration_;
  std::optional<Vec3> last_v_;
  Vec3 integral_ = Vec3::Zero(), v_wanted_ = Vec3::Zero(), a_wanted_ = Vec3::Zero();
};

/// q_LV with z along the thrust and x as near to the heading as that allows.
Quat attitude_for(const Vec3& thrust, double yaw_rad);

}  // namespace fbvins
