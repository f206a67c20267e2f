// SPDX-License-Identifier: Apache-2.0
// What no flight can tell: how wrong the calibrated distance between the cameras is, and with it all lengths
// (docs/derivations/window.md, W21). Pure functions.
#pragma once

#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// What a careful calibration leaves open of the distance between the cameras: standard deviation, m.
inline constexpr double kBaselineSigma_m = 0.0003;

/// Standard deviation of all lengths, as a share of them.
inline double scale_sigma(const Pose<B, C0>& T_BC0, const Pose<B, C1>& T_BC1) {
  return kBaselineSigma_m / (T_BC1.p - T_BC0.p).norm();
}

/// Adds to a covariance of `length` [m, or m/s] what an unknown scale makes of it (W21).
template <class Block>
void add_scale(const Vec3& length, double scale_sigma, Block&& covariance) {
  covariance += scale_sigma * scale_sigma * length * length.transpose();
}

}  // namespace fbvins
