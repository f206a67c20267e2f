// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/standing_bias.hpp"

#include <Eigen/LU>

namespace fbvins {
namespace {

/// 99.7 % of two degrees of freedom.
constexpr double kGate = 11.8;

}  // namespace

ImuBiasEstimate standing_bias(const ImuBiasEstimate& prior, const Vec3& force_mps2, const LevelStand& stand,
                              double gravity_mps2) {
  Eigen::Matrix<double, 3, 2> across;  // of up
  across.col(0) = stand.up_B.unitOrthogonal();
  across.col(1) = stand.up_B.cross(across.col(0));
  const double sigma_mps2 = gravity_mps2 * stand.tilt_sigma_rad;
  const Vec2 innovation = across.transpose() * (force_mps2 - prior.bias.accel_mps2);                                 // eq. A22
  const Mat2 S = across.transpose() * prior.accel_covariance * across + sigma_mps2 * sigma_mps2 * Mat2::Identity();  // eq. A23
  const Mat2 weight = S.inverse();
  if (!(innovation.dot(weight * innovation) < kGate)) return prior;
  const Eigen::Matrix<double, 3, 2> gain = prior.accel_covariance * across * weight;
  ImuBiasEstimate out = prior;  // eq. A24
  out.bias.accel_mps2 += gain * innovation;
  out.accel_covariance -= gain * S * gain.transpose();
  return out;
}

}  // namespace fbvins
