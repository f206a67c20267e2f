// SPDX-License-Identifier: Apache-2.0
// What calibrations leave open and no measurement of a flight shows: the error of the baseline, which scales all lengths, and
// that of the accelerometer's axes, which acts on gravity as a bias (docs/derivations/window.md, W21, W22). Pure functions.
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// Standard deviation of the baseline after a careful calibration, m.
inline constexpr double kBaselineSigma_m = 0.0003;

/// Standard deviation of the scale and of the direction of each axis of a calibrated accelerometer, 1 and rad.
inline constexpr double kAccelAxisSigma = 0.001;

/// Variance of each component of the accelerometer's bias, (m/s^2)^2, that its axes add (W22).
inline double axis_variance(double gravity_mps2) { return kAccelAxisSigma * kAccelAxisSigma * gravity_mps2 * gravity_mps2; }

/// Relative standard deviation of all lengths.
inline double scale_sigma(const Pose<B, C0>& T_BC0, const Pose<B, C1>& T_BC1) {
  return kBaselineSigma_m / (T_BC1.p - T_BC0.p).norm();
}

/// Adds the effect of the unknown scale to the covariance of `length` [m, or m/s] (W21).
template <class Block>
void add_scale(const Vec3& length, double scale_sigma, Block&& covariance) {
  covariance += scale_sigma * scale_sigma * length * length.transpose();
}

}  // namespace fbvins
