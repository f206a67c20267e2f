// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/protection.hpp"

#include <gtest/gtest.h>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace protection_test {

constexpr Health kGood{HealthState::good, HealthReason::none};

TEST(Protection, IsAMultipleOfTheWorstDirectionsStandardDeviation) {
  const Mat3 R = so3_exp(Vec3(0.3, -0.5, 0.8)).toRotationMatrix();
  Mat6 covariance = Mat6::Identity();
  covariance.topLeftCorner<3, 3>() = R * Vec3(0.01, 0.04, 0.0001).asDiagonal() * R.transpose();
  EXPECT_NEAR(worst_sigma_m(covariance), 0.2, 1e-12);
  EXPECT_NEAR(protection_level_m(kGood, covariance), 0.2 * kProtectionOnceIn1e4, 1e-12);
  EXPECT_NEAR(protection_level_m(kGood, covariance, IntegrityRisk::once_in_1e6), 0.2 * kProtectionOnceIn1e6, 1e-12);
}

TEST(Protection, IsInfiniteWithoutAPoseOrACovariance) {
  EXPECT_TRUE(std::isinf(protection_level_m({HealthState::lost, HealthReason::no_images}, Mat6::Identity())));
  EXPECT_TRUE(std::isinf(protection_level_m(kGood, Mat6::Constant(std::numeric_limits<double>::quiet_NaN()))));
}

}  // namespace protection_test
}  // namespace fbvins
