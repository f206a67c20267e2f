// SPDX-License-Identifier: Apache-2.0
// The inner loops of the cascade: attitude to rates (P on quaternions, tilt before yaw), rates to torques (PID with filters), and
// torques to motors. Like PX4's mc_att_control, mc_rate_control and control allocation. One owner each.
//
//   Vec3 rates = rates_for(options.attitude, q_LV, wanted);                      // rad/s, in V
//   Vec3 torque = rate_controller.update(gyro_radps, rates, saturation);         // shares, about V's axes
//   MixedMotors motors = mix(thrust, torque, options.THR_MDL_FAC);               // commands in [0, 1]
#pragma once

#include <optional>

#include "fbvins/flight/position_controller.hpp"

namespace fbvins {

Vec3 rates_for(const AttitudeControlOptions& options, const Quat& q_LV, const AttitudeSetpoint& wanted);

/// About which axes and in which direction the torque is saturated: the integrator must not grow there.
struct TorqueSaturation {
  Eigen::Array<bool, 3, 1> positive = Eigen::Array<bool, 3, 1>::Constant(false);
  Eigen::Array<bool, 3, 1> negative = Eigen::Array<bool, 3, 1>::Constant(false);
};

class RateController {
 public:
  RateController(const RateControlOptions& options, double rate_hz);

  /// Rates in V, rad/s. Returns torques as shares of the largest: see mix().
  Vec3 update(const Vec3& measured, const Vec3& wanted, const TorqueSaturation& saturation);
  void reset() { integral_.setZero(); }
  /// The filtered rate, rad/s in V.
  const Vec3& filtered() const { return rate_; }

 private:
  RateControlOptions options_;
  double dt_s_;
  Vec3 P_, I_, D_, FF_, limit_;
  ButterworthFilter rate_filter_, acceleration_filter_;
  std::optional<Vec3> last_;
  Vec3 rate_ = Vec3::Zero(), integral_ = Vec3::Zero();
};

struct MixedMotors {
  PerRotor commands{};
  TorqueSaturation saturation;
};

/// A roll or pitch torque of 1 changes each rotor's thrust by 1/sqrt(2) of full thrust, a yaw torque of 1 by all of it, as in
/// PX4 for a quadrotor in X. At the upper limit thrust is reduced for roll and pitch, but never raised; yaw comes last.
MixedMotors mix(double thrust, const Vec3& torque, double thrust_model);

}  // namespace fbvins
