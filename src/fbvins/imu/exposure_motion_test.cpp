// SPDX-License-Identifier: Apache-2.0
// How observations are referred to the stamp with it: estimator/exposures_test.cpp.
#include "fbvins/imu/exposure_motion.hpp"

#include <gtest/gtest.h>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace exposure_motion_test {

const Vec3 kGravity_B(0.3, -0.2, -9.8);

TEST(ExposureMotion, WithoutReadingsNothingTurns) {
  const ExposureMotion none({}, {});
  EXPECT_EQ(none.turn(-0.02).coeffs(), Quat::Identity().coeffs());
  EXPECT_EQ(none.moved(0.01), Vec3::Zero());
}

/// A constant rate and acceleration, 50 ms of readings.
TEST(ExposureMotion, TheBodyBeforeAndAfterTheStamp) {
  const Vec3 w(0.8, -1.5, 2), a(3, 1, -2), v(1, -2, 0.5);
  const ImuBias bias{Vec3(0.02, -0.03, 0.01), Vec3(0.1, 0.05, -0.08)};
  ImuSegment readings;
  for (int i = -10; i <= 0; ++i)
    readings.samples.push_back({Time{1'000'000'000 + i * 5'000'000}, w + bias.gyro_radps, a - kGravity_B + bias.accel_mps2});
  const ExposureMotion motion(readings, bias, kGravity_B);
  for (const double s : {-0.045, -0.0025, 0.0, 0.015}) {
    const Pose<B, B> body = motion.body(s, v);
    EXPECT_LT(so3_log(body.q.conjugate() * so3_exp(s * w)).norm(), 1e-12) << s;
    EXPECT_LT((body.p - (s * v + 0.5 * s * s * a)).norm(), 1e-12) << s;
  }
}

}  // namespace exposure_motion_test
}  // namespace fbvins
