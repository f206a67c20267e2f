// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/tilt.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace tilt_test {

const NavState<G> kState{{so3_exp(Vec3(0.4, -1.1, 2.0)), Vec3(3, -2, 1)}, Vec3(0.5, 1.5, -0.7), {Vec3(1, 2, 3), Vec3(4, 5, 6)}};
const Tilt kTilt{Vec2(0.2, -0.3), Vec3(1, 1, 0.5)};

TEST(Tilt, LevelledGravityPointsDown) {
  const Vec3 g = kTilt.q().conjugate() * kTilt.gravity_G(9.81);
  EXPECT_LT((g - level_gravity()).norm(), 1e-12);
  EXPECT_GT((kTilt.gravity_G(9.81) - level_gravity()).norm(), 1);
}

TEST(Tilt, LevellingTurnsAllAboutThePivot) {
  EXPECT_LT((kTilt.levelled(kTilt.pivot) - kTilt.pivot).norm(), 1e-15);
  const NavState<W> level = kTilt.levelled(kState);
  // What the accelerometer reads at rest, what lies ahead, and how fast: the same in the body.
  EXPECT_LT((level.T_FB.q.conjugate() * level_gravity() - kState.T_FB.q.conjugate() * kTilt.gravity_G(9.81)).norm(), 1e-12);
  EXPECT_LT((level.T_FB.inverse() * kTilt.levelled(Vec3(7, 8, 9)) - kState.T_FB.inverse() * Vec3(7, 8, 9)).norm(), 1e-12);
  EXPECT_LT((level.T_FB.q.conjugate() * level.v_FB - kState.T_FB.q.conjugate() * kState.v_FB).norm(), 1e-12);
  EXPECT_EQ(level.bias.gyro_radps, kState.bias.gyro_radps);
}

TEST(Tilt, JacobiansAreThoseOfDifferences) {
  constexpr double kStep = 1e-6;
  const Mat32 gravity = kTilt.gravity_jacobian(9.81);
  const Mat15x17 levelled = kTilt.levelled_jacobian(kState);
  for (int k = 0; k < 17; ++k) {
    Tilt more = kTilt, less = kTilt;
    Vec15 d = Vec15::Zero();
    if (k < 15) {
      d(k) = kStep;
    } else {
      more.angle_rad(k - 15) += kStep;
      less.angle_rad(k - 15) -= kStep;
      const Vec3 difference = (more.gravity_G(9.81) - less.gravity_G(9.81)) / (2 * kStep);
      EXPECT_LT((gravity.col(k - 15) - difference).norm(), 1e-7) << k;
    }
    const Vec15 difference = more.levelled(kState.boxplus(d)).boxminus(less.levelled(kState.boxplus(-d))) / (2 * kStep);
    EXPECT_LT((levelled.col(k) - difference).norm(), 1e-7) << k;
  }
}

}  // namespace tilt_test
}  // namespace fbvins
