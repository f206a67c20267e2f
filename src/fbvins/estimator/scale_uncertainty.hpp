// SPDX-License-Identifier: Apache-2.0
// Uncertainty of scale: the error of the calibrated baseline scales all lengths, and no measurement of a flight shows it
// (docs/derivations/window.md, W21). Pure functions.
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// Standard deviation of the baseline after a careful calibration, m.
inline constexpr double kBaselineSigma_m = 0.0003;

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
