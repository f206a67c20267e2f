// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/quality.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace fbvins {
namespace quality_test {

constexpr Health kGood{HealthState::good, HealthReason::none};

Mat6 position_sigma(double sigma_m) {
  Mat6 covariance = Mat6::Identity();  // attitude does not count
  covariance.topLeftCorner<3, 3>() = sigma_m * sigma_m / 3 * Mat3::Identity();
  return covariance;
}

TEST(Quality, HalvesAtAProtectionLevelOfHalfAMetreAndFallsWithEveryCentimetre) {
  EXPECT_EQ(quality_percent(kGood, position_sigma(0)), 100);
  EXPECT_EQ(quality_percent(kGood, position_sigma(std::sqrt(3) * kHalfQuality_m / kProtectionOnceIn1e4)), 50);
  int last = 101;
  for (const double sigma_m : {0.01, 0.02, 0.03, 0.05, 0.08, 0.15, 0.3, 0.8}) {
    const int now = quality_percent(kGood, position_sigma(sigma_m));
    EXPECT_LT(now, last) << sigma_m;
    last = now;
  }
}

TEST(Quality, IsNeverZeroWithAPoseAndAlwaysWithoutOne) {
  EXPECT_EQ(quality_percent(kGood, position_sigma(1e6)), 1);
  EXPECT_EQ(quality_percent(kGood, position_sigma(std::numeric_limits<double>::quiet_NaN())), 1);
  EXPECT_EQ(quality_percent({HealthState::lost, HealthReason::no_tracks}, position_sigma(0)), 0);
  EXPECT_EQ(quality_percent({HealthState::initialising, HealthReason::none}, position_sigma(0)), 0);
}

TEST(Quality, ADegradedPoseHasLowQualityWhateverItsCovariance) {
  const Health degraded{HealthState::degraded, HealthReason::few_tracks};
  EXPECT_EQ(quality_percent(degraded, position_sigma(0.001)), kMostDegradedQuality_percent);
  EXPECT_LT(quality_percent(degraded, position_sigma(0.5)), kMostDegradedQuality_percent);
}

}  // namespace quality_test
}  // namespace fbvins
