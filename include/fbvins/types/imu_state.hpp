// SPDX-License-Identifier: Apache-2.0
// The IMU's biases, and the time between it and the images, as estimated at the end of a flight: the prior with which the next
// one starts.
#pragma once

#include <optional>

#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Biases with their covariance.
struct ImuBiasEstimate {
  ImuBias bias;
  Mat3 gyro_covariance = Mat3::Zero();   ///< rad^2/s^2
  Mat3 accel_covariance = Mat3::Zero();  ///< m^2/s^4
};

struct TimeOffsetEstimate {
  double s = 0, sigma_s = 0;
};

struct ImuState {
  Time t;  ///< of the last image, on the sensors' clock
  ImuBiasEstimate biases;
  std::optional<TimeOffsetEstimate> time_offset = {};  ///< t_imu = t_image + this, of camera 0; none where it was not looked for
};

}  // namespace fbvins
