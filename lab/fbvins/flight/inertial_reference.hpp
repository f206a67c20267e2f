// SPDX-License-Identifier: Apache-2.0
// Which way is up, and how fast it climbs, from IMU and barometer alone: what is left when the odometry is gone. While there are
// poses it follows them, so that it can go on from the last one. One owner.
//
//   reference.predict(reading, dt_s);                 // every reading
//   if (pose) reference.follow(estimate, bias);
//   if (height) reference.correct(*height);
#pragma once

#include <optional>

#include "fbvins/flight/position_controller.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

class InertialReference {
 public:
  explicit InertialReference(const Pose<BodyFlu, B>& mounting) : mounting_(mounting) {}

  void predict(const ImuSample& reading, double dt_s);
  void follow(const VehicleEstimate& estimate, const ImuBias& bias);
  /// At Barometer::kRate_hz.
  void correct(double barometer_m);

  /// Attitude and climb; where it is sideways and how fast is not known: the last position, no speed.
  const VehicleEstimate& estimate() const { return state_; }

 private:
  Pose<BodyFlu, B> mounting_;
  VehicleEstimate state_;
  ImuBias bias_;                   ///< in B
  double accel_z_error_mps2_ = 0;  ///< what the barometer says that acceleration is off by
  std::optional<double> zero_m_;   ///< barometer at z = 0 of L
  bool following_ = false;
};

}  // namespace fbvins
