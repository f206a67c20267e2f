// SPDX-License-Identifier: Apache-2.0
// How reliable a pose is, as one number.
//
//   if (quality_percent(odometry.health, odometry.pose_covariance) < 50) slow_down();
#pragma once

#include <algorithm>
#include <cmath>

#include "fbvins/types/protection.hpp"

namespace fbvins {

/// Protection level (once in 10^4) at which the quality is 50.
inline constexpr double kHalfQuality_m = 0.5;
/// Upper limit while the health is degraded.
inline constexpr int kMostDegradedQuality_percent = 30;

/// 1 to 100 where there is a pose, 0 where there is none. While the health is good it depends on the protection level alone and
/// ranks poses as the position's covariance does (docs/experiments/consistency.md: how it ranks their errors).
/// `pose_covariance` is of (position [m], attitude [rad]), in any axes.
inline int quality_percent(const Health& health, const Mat6& pose_covariance) {
  if (!health.has_pose()) return 0;
  const double level_m = protection_level_m(health, pose_covariance);
  if (!std::isfinite(level_m)) return 1;
  const int most = health.state == HealthState::degraded ? kMostDegradedQuality_percent : 100;
  return std::clamp(static_cast<int>(std::lround(100 / (1 + level_m / kHalfQuality_m))), 1, most);
}

}  // namespace fbvins
