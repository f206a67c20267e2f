// SPDX-License-Identifier: Apache-2.0
// The whole cascaded controller: from estimate and setpoint to four motor commands. One owner.
//
//   CascadeController controller(options, 200);
//   PerRotor commands = controller.fly(estimate, setpoint);       // every IMU reading
//   log(controller.trace());
//
// Its two parts can be used alone: position_controller.hpp, rate_controller.hpp.
#pragma once

#include "fbvins/flight/rate_controller.hpp"

namespace fbvins {

/// Setpoints and outputs of the loops at the last update.
struct ControlTrace {
  Vec3 v_setpoint = Vec3::Zero();  ///< m/s, in L
  Vec3 a_setpoint = Vec3::Zero();  ///< m/s^2, in L
  Quat q_setpoint = Quat::Identity();
  Vec3 rate_setpoint = Vec3::Zero();  ///< rad/s, in V
  Vec3 rate = Vec3::Zero();           ///< rad/s, in V, filtered
  Vec3 torque = Vec3::Zero();         ///< shares of the largest
  double thrust = 0;                  ///< share of full thrust
  PerRotor commands{};
};

class CascadeController {
 public:
  CascadeController(const ControlOptions& options, double rate_hz);

  /// Follows a path setpoint.
  PerRotor fly(const VehicleEstimate& state, const PathSetpoint& setpoint);
  /// Keeps level at a vertical speed (positive up) and a heading: for flight without a position.
  PerRotor level(const VehicleEstimate& state, double v_z_wanted_mps, double yaw_rad);
  /// Holds an attitude and a thrust, with an additional rate setpoint in V.
  PerRotor hold(const VehicleEstimate& state, const AttitudeSetpoint& wanted, const Vec3& added_rate_radps = Vec3::Zero());
  /// Switches the rotors off and resets the integrators.
  PerRotor rest();

  const ControlTrace& trace() const { return trace_; }

 private:
  ControlOptions options_;
  PositionController position_;
  RateController rate_;
  TorqueSaturation saturation_;
  ControlTrace trace_;
};

}  // namespace fbvins
