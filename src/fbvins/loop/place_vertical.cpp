// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_vertical.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

/// No number of places is more certain than this.
constexpr double kFloor_rad = 0.1 * kDegree;
/// A place that is farther from gravity, in standard deviations, is not used.
constexpr double kGate_sigma = 5;

double square(double x) { return x * x; }

}  // namespace

void PlaceVertical::add(const GaugeState& gauge, const MeasuredPose& seen) {
  const Vec3 up_G = gauge.T_GB.q * (seen.T_MB.q.conjugate() * Vec3::UnitZ());
  const double variance = kSharedError * seen.tilt_variance_rad2;
  const double by_gravity = square(gauge.up_sigma_rad) + square(kMapTilt_rad) + variance;
  if ((up_G - gauge.up_G()).squaredNorm() > square(kGate_sigma) * by_gravity) return;
  const double gain = std::isinf(variance_rad2_) ? 1 : variance_rad2_ / (variance_rad2_ + variance);
  up_G_ = (up_G_ + gain * (up_G - up_G_)).normalized();
  variance_rad2_ = std::max(square(kFloor_rad), gain == 1 ? variance : (1 - gain) * variance_rad2_);
}

LevelledGauge PlaceVertical::level(const GaugeState& gauge) const {
  if (std::isinf(variance_rad2_)) return {gauge.q_LG, gauge.up_sigma_rad};
  const double by_gravity = square(gauge.up_sigma_rad) + square(kMapTilt_rad);
  const double share = by_gravity / (by_gravity + variance_rad2_);
  const Vec3 up_G = (gauge.up_G() + share * (up_G_ - gauge.up_G())).normalized();
  return {so3_between(up_G, Vec3::UnitZ()), std::sqrt(share * variance_rad2_)};
}

}  // namespace fbvins
