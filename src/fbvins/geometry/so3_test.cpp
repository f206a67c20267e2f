// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/so3.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace so3_test {

/// Angles where formulas switch or degenerate, and random ones.
std::vector<Vec3> nasty_rotations(double max_angle) {
  Rng rng(1);
  std::vector<Vec3> out{Vec3::Zero()};
  for (double angle : {1e-300, 1e-16, 1e-9, 0.99e-7, 1.01e-7, 0.99e-4, 1.01e-4, 1e-2, 1.0, 3.0, std::numbers::pi - 1e-6}) {
    for (int i = 0; i < 20; ++i) {
      const Vec3 axis = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
      if (angle < max_angle) out.push_back(angle * axis);
    }
  }
  return out;
}

TEST(So3, LogInvertsExp) {
  for (const Vec3& theta : nasty_rotations(4)) EXPECT_LT((so3_log(so3_exp(theta)) - theta).norm(), 1e-9) << theta.transpose();
}

TEST(So3, ExpMatchesAngleAxis) {
  for (const Vec3& theta : nasty_rotations(4)) {
    const double a = theta.norm();
    if (a < 1e-200) continue;
    const Mat3 expected = Eigen::AngleAxisd(a, theta / a).toRotationMatrix();
    EXPECT_LT((so3_exp(theta).toRotationMatrix() - expected).norm(), 1e-14) << theta.transpose();
  }
}

TEST(So3, LogOfMinusQIsLogOfQ) {
  const Quat q = so3_exp(Vec3(0.3, -0.2, 0.9));
  const Quat m(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((so3_log(q) - so3_log(m)).norm(), 1e-15);
}

TEST(So3, RightJacobianMatchesDifferences) {
  const double h = 1e-6;
  for (const Vec3& theta : nasty_rotations(3.1)) {
    const Mat3 J = so3_right_jacobian(theta);
    for (int k = 0; k < 3; ++k) {
      const Vec3 d = h * Vec3::Unit(k);
      const Vec3 plus = so3_log(so3_exp(theta).conjugate() * so3_exp(theta + d));
      const Vec3 minus = so3_log(so3_exp(theta).conjugate() * so3_exp(theta - d));
      EXPECT_LT((J.col(k) - (plus - minus) / (2 * h)).norm(), 2e-8) << theta.transpose();
    }
  }
}

TEST(So3, TheRotationBetweenTwoDirections) {
  for (const Vec3& theta : nasty_rotations(3.1)) {
    const Vec3 from(0.3, -0.7, 1.9), to = 2.5 * (so3_exp(theta) * from);
    const Quat q = so3_between(from, to);
    EXPECT_NEAR(q.norm(), 1, 1e-12);
    EXPECT_LT((q * from.normalized() - to.normalized()).norm(), 1e-9) << theta.transpose();
    EXPECT_LE(so3_log(q).norm(), so3_log(so3_exp(theta)).norm() + 1e-6) << "not the smallest rotation";
  }
  const Vec3 down = so3_between(Vec3::UnitZ(), -Vec3::UnitZ()) * Vec3::UnitZ();
  EXPECT_LT((down + Vec3::UnitZ()).norm(), 1e-12);
}

TEST(So3, InverseOfRightJacobian) {
  for (const Vec3& theta : nasty_rotations(3.1)) {
    EXPECT_LT((so3_right_jacobian(theta) * so3_right_jacobian_inverse(theta) - Mat3::Identity()).norm(), 1e-9)
        << theta.transpose();
  }
}

}  // namespace so3_test
}  // namespace fbvins
