// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/odometry_drift.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Before, the covariance is that of the start.
constexpr double kShortestPath_m = 3;
/// The drift is taken to be within this factor of what is assumed without a covariance, either way.
constexpr double kMostFactor = 4;

double within(double rate, double assumed) { return std::clamp(rate, assumed / kMostFactor, kMostFactor * assumed); }

}  // namespace

void OdometryDrift::take(const Mat6& covariance, const GaugeState& gauge, double path_m) {
  if (covariance.isZero(0) || !covariance.allFinite()) return;
  const Mat3 P_theta = covariance.bottomRightCorner<3, 3>();
  const Vec3 up_B = gauge.T_GB.q.conjugate() * gauge.up_G();
  // A wrong attitude displaces the position as well, which the graph does itself: of the position only what remains is drift.
  const Mat3 P_p = covariance.topLeftCorner<3, 3>() -
                   covariance.topRightCorner<3, 3>() * Ldlt<3>(P_theta).solve(Mat3(covariance.bottomLeftCorner<3, 3>()));
  const Uncertainty now_is{path_m, P_p.trace() / 3, up_B.dot(P_theta * up_B)};
  if (!first_) first_ = now_is;
  const double way_m = path_m - first_->path_m;
  if (way_m < kShortestPath_m) return;
  const auto rate = [&](double variance, double at_first) { return std::sqrt(std::max(0.0, variance - at_first) / way_m); };
  DriftOptions now;
  now.position_m = within(rate(now_is.position_m2, first_->position_m2), assumed_.position_m);
  now.yaw_rad = within(rate(now_is.yaw_rad2, first_->yaw_rad2), assumed_.yaw_rad);
  // Re-observed landmarks stop the growth, while the steps between keyframes err as before: so the fastest growth so far.
  if (known_) now = {std::max(now.position_m, rate_.position_m), std::max(now.yaw_rad, rate_.yaw_rad)};
  rate_ = now;
  known_ = true;
}

}  // namespace fbvins
