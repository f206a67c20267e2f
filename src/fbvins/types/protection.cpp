// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/protection.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace fbvins {

double worst_sigma_m(const Mat6& pose_covariance) {
  const Mat3 position = pose_covariance.topLeftCorner<3, 3>();
  if (!position.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Mat3>(position, Eigen::EigenvaluesOnly).eigenvalues()(2)));
}

double protection_level_m(const Health& health, const Mat6& pose_covariance, IntegrityRisk risk) {
  const double sigma_m = worst_sigma_m(pose_covariance);
  if (!health.has_pose() || !std::isfinite(sigma_m)) return std::numeric_limits<double>::infinity();
  return (risk == IntegrityRisk::once_in_1e4 ? kProtectionOnceIn1e4 : kProtectionOnceIn1e6) * sigma_m;
}

}  // namespace fbvins
