// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/floor_level.hpp"

#include <numbers>

namespace fbvins {
namespace {

/// Standard deviation of a standing vehicle's tilt, including its IMU's mounting.
constexpr double kFloor_rad = 0.2 * std::numbers::pi / 180;

}  // namespace

Quat FloorLevel::correction(const Odometry& odometry, const Quat& q_LW) const {
  if (!z_G_) return Quat::Identity();
  const Quat q_WG = odometry.T_WB.q * odometry.gauge.T_GB.q.conjugate();
  const Vec3 up_L = q_LW * (q_WG * *z_G_);
  const double variance = odometry.gauge.up_sigma_rad * odometry.gauge.up_sigma_rad;
  const double weight = variance / (variance + kFloor_rad * kFloor_rad);
  return so3_exp(weight * so3_log(so3_between(up_L, Vec3::UnitZ())));
}

}  // namespace fbvins
