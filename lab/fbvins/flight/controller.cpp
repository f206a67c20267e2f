// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/controller.hpp"

namespace fbvins {

CascadeController::CascadeController(const ControlOptions& options, double rate_hz)
    : options_(options), position_(options.position, rate_hz), rate_(options.rate, rate_hz) {}

PerRotor CascadeController::fly(const VehicleEstimate& state, const PathSetpoint& setpoint) {
  const AttitudeSetpoint wanted = position_.update(state, setpoint);
  trace_.v_setpoint = position_.velocity_setpoint();
  trace_.a_setpoint = position_.acceleration_setpoint();
  return hold(state, wanted);
}

PerRotor CascadeController::level(const VehicleEstimate& state, double v_z_wanted_mps, double yaw_rad) {
  const AttitudeSetpoint wanted = position_.climb(state.v_LV.z(), v_z_wanted_mps, yaw_rad);
  trace_.v_setpoint = position_.velocity_setpoint();
  trace_.a_setpoint = position_.acceleration_setpoint();
  return hold(state, wanted);
}

PerRotor CascadeController::hold(const VehicleEstimate& state, const AttitudeSetpoint& wanted, const Vec3& added_rate_radps) {
  trace_.q_setpoint = wanted.q_LV;
  trace_.thrust = wanted.thrust;
  trace_.rate_setpoint = rates_for(options_.attitude, state.T_LV.q, wanted) + added_rate_radps;
  trace_.torque = rate_.update(state.w_LV_V, trace_.rate_setpoint, saturation_);
  trace_.rate = rate_.filtered();
  const MixedMotors motors = mix(trace_.thrust, trace_.torque, options_.THR_MDL_FAC);
  saturation_ = motors.saturation;
  return trace_.commands = motors.commands;
}

PerRotor CascadeController::rest() {
  position_.reset();
  rate_.reset();
  saturation_ = {};
  trace_ = {};
  return trace_.commands;
}

}  // namespace fbvins
