// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/svd3.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace fbvins {
namespace svd3_test {
namespace {

TEST(Svd3, ItsFactorsAreOrthogonalAndGiveTheMatrix) {
  Mat3 A;
  A << 2, -1, 0.5, 0.3, 1, -4, 0, 1e-6, 3;
  for (const Mat3& matrix : {A, Mat3(A * Vec3(1, 1, 0).asDiagonal()), Mat3(Mat3::Zero())}) {
    const Svd3 svd = svd3(matrix);
    EXPECT_TRUE((svd.U.transpose() * svd.U).isApprox(Mat3::Identity(), 1e-14));
    EXPECT_TRUE((svd.V.transpose() * svd.V).isApprox(Mat3::Identity(), 1e-14));
    EXPECT_LT((svd.U * svd.values.asDiagonal() * svd.V.transpose() - matrix).norm(), 1e-14 * (1 + matrix.norm()));
    EXPECT_GE(svd.values(0), svd.values(1));
    EXPECT_GE(svd.values(1), svd.values(2));
  }
}

}  // namespace
}  // namespace svd3_test
}  // namespace fbvins
