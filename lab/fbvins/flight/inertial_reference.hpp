// SPDX-License-Identifier: Apache-2.0
// Attitude and vertical speed from IMU and barometer alone, for flight without odometry. While there are poses it follows them,
// and continues from the last one. One owner.
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
  /// A barometer reading [m]; call at Barometer::kRate_hz.
  void correct(double barometer_m);

  /// Attitude, height and vertical speed; horizontally the last known position and zero velocity.
  const VehicleEstimate& estimate() const { return state_; }

 private:
  Pose<BodyFlu, B> mounting_;
  VehicleEstimate state_;
  ImuBias bias_;                   ///< in B
  double accel_z_error_mps2_ = 0;  ///< correction of the vertical acceleration, by the barometer
  std::optional<double> zero_m_;   ///< barometer reading at z = 0 of L
  bool following_ = false;
};

}  // namespace fbvins
