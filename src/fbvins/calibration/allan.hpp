// SPDX-License-Identifier: Apache-2.0
// Private to calibration: Allan variances, and the white noise and random walk of readings at rest
// (docs/derivations/calibration.md, N1-N5).
#pragma once

#include "fbvins/calibration/imu_noise.hpp"

namespace fbvins {

/// Variance over clusters of m readings, and how many independent ones it is worth.
struct AllanVariance {
  double tau_s = 0, variance = 0, freedom = 0;
};

std::vector<AllanVariance> allan_variances(const std::vector<double>& readings, double period_s);

/// One axis at rest.
AxisNoise fit_noise(const std::vector<double>& readings, double period_s);

}  // namespace fbvins
