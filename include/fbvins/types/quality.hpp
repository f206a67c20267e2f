// SPDX-License-Identifier: Apache-2.0
// How reliable a pose is, as one number.
//
//   if (quality_percent(odometry.health, odometry.pose_covariance) < 50) slow_down();
#pragma once

#include <algorithm>
#include <cmath>

#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Position uncertainty at which the quality is 50: square root of the trace of the position's covariance, m.
inline constexpr double kHalfQualitySigma_m = 0.1;
/// Upper limit while the health is degraded.
inline constexpr int kMostDegradedQuality_percent = 30;

/// 1 to 100 where there is a pose, 0 where there is none. While the health is good it depends on the standard deviation of the
/// published position alone and ranks poses as the covariance does (docs/experiments/consistency.md: how it ranks their errors).
/// `pose_covariance` is of (position [m], attitude [rad]), in any axes.
inline int quality_percent(const Health& health, const Mat6& pose_covariance) {
  if (!health.has_pose()) return 0;
  const double sigma_m = std::sqrt(pose_covariance.topLeftCorner<3, 3>().trace());
  if (!std::isfinite(sigma_m)) return 1;
  const int most = health.state == HealthState::degraded ? kMostDegradedQuality_percent : 100;
  return std::clamp(static_cast<int>(std::lround(100 / (1 + sigma_m / kHalfQualitySigma_m))), 1, most);
}

}  // namespace fbvins
