// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/aged_bias.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace aged_bias_test {

const Time kEnd{1'000'000'000'000};

ImuState state() {
  ImuState s;
  s.t = kEnd;
  s.biases.bias = {Vec3(0.01, -0.02, 0.03), Vec3(0.1, 0.2, -0.3)};
  s.biases.gyro_covariance = 1e-8 * Mat3::Identity();
  s.biases.accel_covariance = 1e-4 * Mat3::Identity();
  return s;
}

double accel_sigma(double after_s) {
  return std::sqrt(aged(state(), kEnd + Duration::from_seconds(after_s), {}).accel_covariance(0, 0));
}

TEST(AgedBias, TheMeanStaysAndTheVarianceGrowsWithTime) {
  const ImuBiasEstimate soon = aged(state(), kEnd + Duration::from_seconds(10), {});
  EXPECT_EQ(soon.bias.accel_mps2, state().biases.bias.accel_mps2);
  EXPECT_EQ(soon.bias.gyro_radps, state().biases.bias.gyro_radps);
  EXPECT_GT(accel_sigma(0), std::sqrt(state().biases.accel_covariance(0, 0)));  // the power-on alone adds variance
  EXPECT_GT(accel_sigma(60), accel_sigma(10));
  EXPECT_NEAR(std::pow(accel_sigma(100), 2) - std::pow(accel_sigma(0), 2), 100 * std::pow(3e-3, 2), 1e-12);
}

TEST(AgedBias, ItDoesNotGrowForEver) {
  EXPECT_EQ(accel_sigma(1e6), accel_sigma(1e7));
  EXPECT_LT(accel_sigma(1e7), 0.06);
}

TEST(AgedBias, AClockSetBackMeansTheLargestVariance) { EXPECT_EQ(accel_sigma(-5), accel_sigma(1e6)); }

}  // namespace aged_bias_test
}  // namespace fbvins
