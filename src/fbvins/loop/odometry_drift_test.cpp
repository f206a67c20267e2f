// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/odometry_drift.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace odometry_drift_test {

const DriftOptions kAssumed{.position_m = 0.006, .yaw_rad = 0.001};

/// Of an odometry whose yaw has walked about the vertical by `yaw_rad`, and its position by `position_m` beside what the yaw
/// does to it `arm` away from the beginning.
Mat6 covariance(const GaugeState& gauge, double position_m, double yaw_rad, const Vec3& arm) {
  Vec6 by_yaw;  // in (dp in G, dtheta in B)
  by_yaw << gauge.up_G().cross(arm), gauge.T_GB.q.conjugate() * gauge.up_G();
  Mat6 P = yaw_rad * yaw_rad * by_yaw * by_yaw.transpose();
  P.topLeftCorner<3, 3>().diagonal().array() += position_m * position_m;
  P.bottomRightCorner<3, 3>().diagonal().array() += 1e-12;
  return P;
}

GaugeState turned() {
  GaugeState gauge;
  gauge.T_GB.q = so3_exp(Vec3(0.4, -1.2, 0.7));
  gauge.q_LG = so3_exp(Vec3(0.02, 0.03, 0));
  return gauge;
}

/// At the beginning of a flight, where nothing is uncertain.
OdometryDrift begun() {
  OdometryDrift drift(kAssumed);
  drift.take(covariance(turned(), 0, 1e-6, Vec3::Zero()), turned(), 0);
  return drift;
}

TEST(OdometryDrift, WhatWasUncertainBeforeTheFlightIsNoDrift) {
  OdometryDrift drift(kAssumed);
  drift.take(covariance(turned(), 0.5, 0.1, Vec3::Zero()), turned(), 0);
  drift.take(covariance(turned(), std::sqrt(0.25 + 1.44e-4), std::sqrt(0.01 + 4e-6), Vec3::Zero()), turned(), 16);
  EXPECT_NEAR(drift.rate().position_m, 0.003, 1e-5);
  EXPECT_NEAR(drift.rate().yaw_rad, 0.0005, 1e-6);
}

TEST(OdometryDrift, IsTheCovariancePerMetreWithoutWhatTheYawDoes) {
  OdometryDrift drift = begun();
  drift.take(covariance(turned(), 0.008, 0.002, Vec3(12, -5, 1)), turned(), 16);
  EXPECT_NEAR(drift.rate().position_m, 0.002, 1e-5);
  EXPECT_NEAR(drift.rate().yaw_rad, 0.0005, 1e-6);
}

TEST(OdometryDrift, IsWhatIsAssumedUntilItIsKnown) {
  OdometryDrift drift = begun();
  drift.take(Mat6::Zero(), turned(), 16);
  EXPECT_EQ(drift.rate().position_m, kAssumed.position_m);
  drift.take(covariance(turned(), 0.0005, 0.0001, Vec3::Zero()), turned(), 1);
  EXPECT_EQ(drift.rate().yaw_rad, kAssumed.yaw_rad);
  drift.take(covariance(turned(), 0.004, 0.0008, Vec3::Zero()), turned(), 4);
  EXPECT_LT(drift.rate().yaw_rad, kAssumed.yaw_rad);
}

TEST(OdometryDrift, RevisitedPlacesDoNotMakeTheStepsBetter) {
  OdometryDrift drift = begun();
  drift.take(covariance(turned(), 0.009, 0.0018, Vec3::Zero()), turned(), 9);
  drift.take(covariance(turned(), 0.009, 0.0018, Vec3::Zero()), turned(), 100);
  EXPECT_NEAR(drift.rate().position_m, 0.003, 1e-5);
  EXPECT_NEAR(drift.rate().yaw_rad, 0.0006, 1e-6);
}

TEST(OdometryDrift, StaysWithinLimits) {
  OdometryDrift drift = begun();
  drift.take(covariance(turned(), 1e-5, 1e-6, Vec3::Zero()), turned(), 9);
  EXPECT_DOUBLE_EQ(drift.rate().position_m, kAssumed.position_m / 4);
  drift.take(covariance(turned(), 3, 1, Vec3::Zero()), turned(), 9);
  EXPECT_DOUBLE_EQ(drift.rate().position_m, 4 * kAssumed.position_m);
}

}  // namespace odometry_drift_test
}  // namespace fbvins
