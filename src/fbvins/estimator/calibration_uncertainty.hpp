// SPDX-License-Identifier: Apache-2.0
// What calibrations leave open and no measurement of a flight shows: the error of the baseline, which scales all lengths, and
// those of the IMU's axes, which act on gravity and on turning rates as biases (docs/derivations/window.md, W21-W23). Pure
// functions.
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// Standard deviation of the baseline after a careful calibration, m.
inline constexpr double kBaselineSigma_m = 0.0003;

/// Standard deviation of the scale and of the direction of each axis of a calibrated IMU, 1 and rad.
inline constexpr double kAxisSigma = 0.001;

/// Covariance of the bias that errors of the axes make of a constant quantity, in its unit squared: of gravity for the
/// accelerometer (W22), of the mean turning rate for the gyroscope (W23).
inline Mat3 axis_covariance(double quantity) { return kAxisSigma * kAxisSigma * quantity * quantity * Mat3::Identity(); }

/// Relative standard deviation of all lengths, of two cameras at these places; 0 with one camera, of which the window itself
/// knows the scale and its uncertainty.
inline double scale_sigma(const Vec3& left_B, const Vec3& right_B) {
  const double baseline_m = (right_B - left_B).norm();
  return baseline_m > 0 ? kBaselineSigma_m / baseline_m : 0;
}

/// Adds the effect of the unknown scale to the covariance of `length` [m, or m/s] (W21).
template <class Block>
void add_scale(const Vec3& length, double scale_sigma, Block&& covariance) {
  covariance += scale_sigma * scale_sigma * length * length.transpose();
}

}  // namespace fbvins
