// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/motion_at.hpp"

#include <gtest/gtest.h>

#include "fbvins/types/odometry.hpp"

namespace fbvins {
namespace motion_at_test {

struct X {};

Odometry turning() {
  Odometry o;
  o.T_WB = {so3_exp(Vec3(0.3, -0.7, 1.1)), Vec3(1, 2, 3)};
  o.v_WB = Vec3(0.5, -1, 0.2);
  o.w_WB_B = Vec3(0.9, 0.4, -1.3);
  return o;
}
const Pose<B, X> kMounted{so3_exp(Vec3(-0.4, 0.2, 2)), Vec3(0.1, -0.3, 0.2)};

TEST(MotionAt, VelocityAndRateAreTheDerivativesOfThePose) {
  const Odometry o = turning();
  const auto at = motion_at(kMounted, o);
  constexpr double h = 1e-6;
  Odometry later = o;
  later.T_WB.p += h * o.v_WB;
  later.T_WB.q = o.T_WB.q * so3_exp(h * o.w_WB_B);
  const auto next = motion_at(kMounted, later);
  EXPECT_LT(((next.T_WX.p - at.T_WX.p) / h - at.v_WX).norm(), 1e-5);
  EXPECT_LT((so3_log(at.T_WX.q.conjugate() * next.T_WX.q) / h - at.w_WX_X).norm(), 1e-5);
}

TEST(MotionAt, AnErrorOfTheBodyIsOneOfThePoint) {
  Odometry o = turning();
  Vec6 error;
  error << 1e-6, -2e-6, 3e-6, 2e-6, 1e-6, -1e-6;
  o.pose_covariance = error * error.transpose();
  const auto at = motion_at(kMounted, o);
  Odometry wrong = o;
  wrong.T_WB.p += error.head<3>();
  wrong.T_WB.q = o.T_WB.q * so3_exp(Vec3(error.tail<3>()));
  const auto moved = motion_at(kMounted, wrong);
  Vec6 of_point;
  of_point << moved.T_WX.p - at.T_WX.p, so3_log(at.T_WX.q.conjugate() * moved.T_WX.q);
  EXPECT_LT((at.pose_covariance - of_point * of_point.transpose()).norm(), 1e-5 * of_point.squaredNorm());
}

}  // namespace motion_at_test
}  // namespace fbvins
