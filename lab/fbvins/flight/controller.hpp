// SPDX-License-Identifier: Apache-2.0
// The whole cascade: where the vehicle is and where it should be, to four motors. One owner.
//
//   CascadeController controller(options, 200);
//   PerRotor commands = controller.fly(estimate, setpoint);       // every IMU reading
//   log(controller.trace());
//
// The two halves are public for whoever wants one alone: position_controller.hpp, rate_controller.hpp.
#pragma once

#include "fbvins/flight/rate_controller.hpp"

namespace fbvins {

/// What the loops asked one another for, last.
struct ControlTrace {
  Vec3 v_setpoint = Vec3::Zero();  ///< m/s, in L
  Vec3 a_setpoint = Vec3::Zero();  ///< m/s^2, in L
  Quat q_setpoint = Quat::Identity();
  Vec3 rate_setpoint = Vec3::Zero();  ///< rad/s, in V
  Vec3 rate = Vec3::Zero();           ///< rad/s, in V, as the controller sees it
  Vec3 torque = Vec3::Zero();         ///< shares
  double thrust = 0;                  ///< share
  PerRotor commands{};
};

class CascadeController {
 public:
  CascadeController(const ControlOptions& options, double rate_hz);

  /// Along a path.
  PerRotor fly(const VehicleEstimate& state, const PathSetpoint& setpoint);
  /// Level, at a speed upwards, with the heading that it has: when nothing is known of where the vehicle is.
  PerRotor level(const VehicleEstimate& state, double v_z_wanted_mps, double yaw_rad);
  /// To an attitude and a thrust: what identification flies.
  PerRotor hold(const VehicleEstimate& state, const AttitudeSetpoint& wanted, const Vec3& added_rate_radps = Vec3::Zero());
  /// Rotors off, integrals empty.
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
