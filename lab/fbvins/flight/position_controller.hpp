// SPDX-License-Identifier: Apache-2.0
// The outer half of the cascade: position to velocity (P), velocity to acceleration (PID with anti-windup), acceleration to an
// attitude and a thrust. As PX4's mc_pos_control, in L instead of north-east-down. One owner.
//
//   PositionController position(options, 200);
//   AttitudeSetpoint wanted = position.update(state, setpoint);
#pragma once

#include <optional>

#include "fbvins/flight/control_filters.hpp"
#include "fbvins/flight/control_options.hpp"
#include "fbvins/sim/quadrotor.hpp"

namespace fbvins {

/// The mission's frame: origin where the vehicle stood, x its heading then, z up as far as gravity is known.
struct Local {};

/// The vehicle as its controller knows it: by estimates, never by truth.
struct VehicleEstimate {
  Pose<Local, BodyFlu> T_LV;
  Vec3 v_LV = Vec3::Zero();    ///< m/s, in L
  Vec3 w_LV_V = Vec3::Zero();  ///< rad/s, in V
};

/// A point of a smooth path.
struct PathSetpoint {
  Vec3 p = Vec3::Zero();  ///< m, in L
  Vec3 v = Vec3::Zero();  ///< m/s
  Vec3 a = Vec3::Zero();  ///< m/s^2
  double yaw_rad = 0, yaw_rate_radps = 0;
};

struct AttitudeSetpoint {
  Quat q_LV = Quat::Identity();
  double yaw_rate_radps = 0;
  double thrust = 0;  ///< along the vehicle's z, share of all rotors' full thrust
};

class PositionController {
 public:
  PositionController(const PositionControlOptions& options, double rate_hz);

  AttitudeSetpoint update(const VehicleEstimate& state, const PathSetpoint& setpoint);
  /// Only downwards or upwards, at no tilt: when nothing is known of where the vehicle is.
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

/// The body's z along the thrust, its x as near to the heading as that allows.
Quat attitude_for(const Vec3& thrust, double yaw_rad);

}  // namespace fbvins
