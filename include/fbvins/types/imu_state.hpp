// SPDX-License-Identifier: Apache-2.0
// What a flight knew of its IMU when it ended, for the next one to begin with.
#pragma once

#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Biases and how well they are known.
struct ImuBiasEstimate {
  ImuBias bias;
  Mat3 gyro_covariance = Mat3::Zero();   ///< rad^2/s^2
  Mat3 accel_covariance = Mat3::Zero();  ///< m^2/s^4
};

struct ImuState {
  Time t;  ///< of the last image, on the sensors' clock
  ImuBiasEstimate biases;
};

}  // namespace fbvins
