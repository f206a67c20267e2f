// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/standing_bias.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace standing_bias_test {

constexpr double kPriorSigma = 0.2, kTiltSigma = 0.005;

ImuBiasEstimate unknown() { return {{}, Mat3::Identity(), kPriorSigma * kPriorSigma * Mat3::Identity()}; }

Vec3 normal(Rng& rng) { return {rng.normal(), rng.normal(), rng.normal()}; }

TEST(StandingBias, IsTheTruthAcrossUpAndWhatItWasAlongIt) {
  const Vec3 up = Vec3(0.1, -0.9, 0.3).normalized(), bias(0.15, 0.02, -0.12);
  const ImuBiasEstimate found = standing_bias(unknown(), kGravity_mps2 * up + bias, {up, 1e-4});
  EXPECT_LT(up.cross(found.bias.accel_mps2 - bias).norm(), 1e-5);
  EXPECT_NEAR(up.dot(found.bias.accel_mps2), 0, 1e-9) << "a bias along up is an error of gravity";
  EXPECT_NEAR(up.dot(found.accel_covariance * up), kPriorSigma * kPriorSigma, 1e-12);
}

TEST(StandingBias, ErrorsAreWhatTheCovarianceSays) {
  Rng rng(7);
  double nees = 0;
  constexpr int kTries = 2000;
  for (int i = 0; i < kTries; ++i) {
    const Vec3 up = normal(rng).normalized(), bias = kPriorSigma * normal(rng);
    const Vec3 tilt = kTiltSigma * normal(rng);
    const ImuBiasEstimate found = standing_bias(unknown(), kGravity_mps2 * (so3_exp(tilt) * up) + bias, {up, kTiltSigma});
    const Vec3 error = found.bias.accel_mps2 - bias;
    nees += error.dot(found.accel_covariance.inverse() * error) / 3 / kTries;
  }
  EXPECT_NEAR(nees, 1, 0.05);
}

TEST(StandingBias, AVehicleThatIsNotLevelSaysNothing) {
  const Vec3 up = Vec3::UnitZ(), leaning = so3_exp(Vec3(0.15, 0, 0)) * up;
  const ImuBiasEstimate found = standing_bias(unknown(), kGravity_mps2 * leaning, {up, kTiltSigma});
  EXPECT_EQ(found.bias.accel_mps2, Vec3(Vec3::Zero()));
  EXPECT_EQ(found.accel_covariance, unknown().accel_covariance);
}

TEST(StandingBias, AnImuThatIsKnownIsBelievedMoreThanTheFloor) {
  ImuBiasEstimate known = unknown();
  known.bias.accel_mps2 = Vec3(0.05, 0, 0);
  known.accel_covariance = 1e-6 * Mat3::Identity();
  const Vec3 leaning = so3_exp(Vec3(0, 0.01, 0)) * Vec3(Vec3::UnitZ());
  const ImuBiasEstimate found =
      standing_bias(known, kGravity_mps2 * leaning + known.bias.accel_mps2, {Vec3::UnitZ(), kTiltSigma});
  EXPECT_LT((found.bias.accel_mps2 - known.bias.accel_mps2).norm(), 1e-4);
}

}  // namespace standing_bias_test
}  // namespace fbvins
