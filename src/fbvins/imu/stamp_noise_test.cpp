// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/stamp_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/imu/preintegration.hpp"

namespace fbvins {
namespace stamp_noise_test {

/// (Y8) Integrated, the noise that is added is the turn and the motion within the noise of two stamps.
TEST(StampNoise, ReadingsTurnAndMoveByAsMuchMore) {
  const double stamp_s = 0.002, rate_radps = 0.8, speed_mps = 1.5;
  const ImuNoise noise;
  ImuSegment imu;
  for (int k = 0; k <= 10; ++k) imu.samples.push_back({Time{k * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  const auto covariance = [&] {
    Preintegration p(noise, {});
    p.integrate(imu);
    return p.covariance();
  };
  const Mat15 exact = covariance();
  add_stamp_noise(imu, noise, 0, Vec3(rate_radps, 0, 0), Vec3(0, speed_mps, 0));
  EXPECT_EQ(covariance(), exact);
  add_stamp_noise(imu, noise, stamp_s, Vec3(rate_radps, 0, 0), Vec3(0, speed_mps, 0));
  const Mat15 added = covariance() - exact;
  EXPECT_NEAR(std::sqrt(added(nav::theta, nav::theta)), std::sqrt(2.0) * stamp_s * rate_radps, 1e-6);
  // Force is in z, so that a turn about z moves nothing: what is left is that of the accelerometer.
  EXPECT_NEAR(std::sqrt(added(nav::p + 2, nav::p + 2)), std::sqrt(2.0) * stamp_s * speed_mps, 1e-5);
}

}  // namespace stamp_noise_test
}  // namespace fbvins
