// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/floor_level.hpp"

#include <algorithm>
#include <numbers>

namespace fbvins {
namespace {

/// How level a vehicle stands on its legs, and how well its IMU is mounted: a standard deviation.
constexpr double kFloor_rad = 0.2 * std::numbers::pi / 180;
/// Of a reading in the mean: half a second at 200 Hz.
constexpr double kShare = 0.01;

}  // namespace

void FloorLevel::rest(const ImuSample& reading) {
  const Vec3 accel_V = mounting_.q * reading.accel_mps2;
  accel_V_ = started_ ? Vec3(accel_V_ + kShare * (accel_V - accel_V_)) : accel_V;
  started_ = true;
}

void FloorLevel::stand(double heading_rad) {
  heading_rad_ = heading_rad;
  standing_ = started_;
}

Quat FloorLevel::correction(const Odometry& odometry) const {
  if (!standing_) return Quat::Identity();
  // Up, as the odometry has it now, in the axes of the vehicle that stood there; and in truth its own z, but for the floor.
  const Vec3 up_V = (accel_V_ - mounting_.q * odometry.bias.accel_mps2).normalized();
  const Vec3 tilt = so3_log(Quat::FromTwoVectors(Vec3::UnitZ(), up_V));
  const Mat3 R_WB = odometry.T_WB.q.toRotationMatrix();
  const Mat3 P_W = R_WB * odometry.pose_covariance.block<3, 3>(3, 3) * R_WB.transpose();
  const double variance = std::max(P_W(0, 0), P_W(1, 1));
  return so3_exp(variance / (variance + kFloor_rad * kFloor_rad) * tilt);
}

}  // namespace fbvins
