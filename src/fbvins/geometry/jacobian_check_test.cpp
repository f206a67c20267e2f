// SPDX-License-Identifier: Apache-2.0
#include "tests/support/jacobian_check.hpp"

#include <gtest/gtest.h>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace jacobian_check_test {

const Vec3 kPoint(0.3, -1.2, 2.0);
const Quat kRotation = so3_exp(Vec3(0.4, -0.2, 0.9));

/// R Exp(theta) x + p, and |p|^2: four rows.
Eigen::VectorXd residual(const Eigen::VectorXd& d) {
  const Vec3 p = Vec3(1, 2, 3) + d.head<3>();
  Eigen::VectorXd r(4);
  r << kRotation * so3_exp(d.tail<3>()) * kPoint + p, p.squaredNorm();
  return r;
}

Eigen::MatrixXd right_jacobian() {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(4, 6);
  J.block<3, 3>(0, 0).setIdentity();
  J.block<3, 3>(0, 3) = -kRotation.toRotationMatrix() * hat(kPoint);
  J.block<1, 3>(3, 0) = 2 * Vec3(1, 2, 3).transpose();
  return J;
}

const std::vector<JacobianBlock> kRows = {{"point", 3}, {"range", 1}}, kColumns = {{"position", 3}, {"rotation", 3}};

TEST(JacobianCheck, AcceptsACorrectJacobian) {
  const JacobianCheck check = check_jacobian(residual, right_jacobian(), kRows, kColumns, 1e-9);
  EXPECT_TRUE(check.ok) << check.message;
}

TEST(JacobianCheck, NamesTheBlockWithAWrongSign) {
  Eigen::MatrixXd J = right_jacobian();
  J.block<3, 3>(0, 3) *= -1;
  const JacobianCheck check = check_jacobian(residual, J, kRows, kColumns);
  EXPECT_FALSE(check.ok);
  EXPECT_NE(check.message.find("d point / d rotation"), std::string::npos) << check.message;
}

TEST(JacobianCheck, NamesTheBlockWithASmallErrorInOneEntry) {
  Eigen::MatrixXd J = right_jacobian();
  J(3, 1) += 1e-5;
  const JacobianCheck check = check_jacobian(residual, J, kRows, kColumns, 1e-7);
  EXPECT_FALSE(check.ok);
  EXPECT_NE(check.message.find("d range / d position"), std::string::npos) << check.message;
}

TEST(JacobianCheck, RefusesNanAndWrongSizes) {
  Eigen::MatrixXd J = right_jacobian();
  J(1, 4) = std::nan("");
  const JacobianCheck nan_check = check_jacobian(residual, J, kRows, kColumns);
  EXPECT_FALSE(nan_check.ok);
  EXPECT_NE(nan_check.message.find("d point / d rotation"), std::string::npos) << nan_check.message;
  EXPECT_FALSE(check_jacobian(residual, right_jacobian().topRows(3), kRows, kColumns).ok);
  EXPECT_FALSE(check_jacobian(residual, right_jacobian(), {{"point", 3}}, kColumns).ok);
}

}  // namespace jacobian_check_test
}  // namespace fbvins
