// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/ldlt.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace ldlt_test {
namespace {

template <int Rows, int Columns>
Eigen::Matrix<double, Rows, Columns> some_numbers(Rng& random) {
  Eigen::Matrix<double, Rows, Columns> m;
  for (int i = 0; i < m.size(); ++i) m.data()[i] = random.uniform(-0.5, 0.5);
  return m;
}

template <int N>
Eigen::Matrix<double, N, N> definite(Rng& random) {
  const auto root = some_numbers<N, N>(random);
  return root * root.transpose() + 0.01 * Eigen::Matrix<double, N, N>::Identity();
}

template <int N, int Columns, int Order = Eigen::ColMajor>
void solves_as_in_place() {
  using Right = Eigen::Matrix<double, N, Columns, Order>;
  Rng random(N);
  for (int i = 0; i < 20; ++i) {
    const auto A = definite<N>(random);
    const Right b = some_numbers<N, Columns>(random), expected = A.ldlt().solve(b);
    const Ldlt<N> ldlt(A);
    ASSERT_TRUE(ldlt.succeeded());
    EXPECT_EQ(ldlt.solve(b), expected);
    EXPECT_EQ(ldlt.least_pivot(), A.ldlt().vectorD().minCoeff());
  }
}

TEST(Ldlt, HasTheBitsOfEigensInPlace) {
  solves_as_in_place<3, 1>();
  solves_as_in_place<3, 9>();
  solves_as_in_place<4, 4>();
  solves_as_in_place<5, 1>();
  solves_as_in_place<6, 1>();
  solves_as_in_place<6, 4>();
  solves_as_in_place<6, 4, Eigen::RowMajor>();
  solves_as_in_place<8, 1>();
  solves_as_in_place<8, 8>();
  solves_as_in_place<9, 1>();
}

TEST(Ldlt, AnIndefiniteMatrixHasANegativePivot) {
  const Mat3 A = Vec3(1, -2, 3).asDiagonal();
  EXPECT_LT(Ldlt<3>(A).least_pivot(), 0);
}

TEST(Inverted, HasTheBitsOfEigensInPlace) {
  Rng random(1);
  const Mat6 A = definite<6>(random);
  EXPECT_EQ(inverted(A), Mat6(A.inverse()));
}

TEST(UpperCholesky, HasTheBitsOfEigensInPlace) {
  Rng random(2);
  const Mat6 A = definite<6>(random);
  EXPECT_EQ(upper_cholesky(A), Mat6(Eigen::LLT<Mat6>(A).matrixU()));
  EXPECT_TRUE(is_positive_definite(A));
  Mat6 indefinite = A;
  indefinite(2, 2) = -1;
  EXPECT_FALSE(is_positive_definite(indefinite));
}

}  // namespace
}  // namespace ldlt_test
}  // namespace fbvins
