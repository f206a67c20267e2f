// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/dense_system.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace fbvins {
namespace dense_system_test {

/// Well conditioned; with eigenvalues of both signs where `indefinite`.
Eigen::MatrixXd symmetric(int n, bool indefinite) {
  Eigen::MatrixXd H(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) H(i, j) = i == j ? (indefinite && i % 2 ? -4.0 - i : 4.0 + i) : 1.0 / (1 + i + j);
  return H;
}

TEST(DenseSystem, SolvesDefiniteAndIndefiniteSystems) {
  for (const int n : {1, 2, 7, 40})
    for (const bool indefinite : {false, true}) {
      const Eigen::MatrixXd H = symmetric(n, indefinite);
      const Eigen::VectorXd wanted = Eigen::VectorXd::LinSpaced(n, -1, 3);
      const auto x = solve_symmetric(H, H * wanted);
      ASSERT_TRUE(x);
      EXPECT_LT((*x - wanted).norm(), 1e-10);
      const auto inverse = invert_symmetric(H);
      ASSERT_TRUE(inverse);
      EXPECT_LT((H * *inverse - Eigen::MatrixXd::Identity(n, n)).norm(), 1e-10);
      const auto both = solve_and_invert_symmetric(H, H * wanted);
      ASSERT_TRUE(both);
      EXPECT_EQ(both->x, *x);
      EXPECT_EQ(both->inverse, *inverse);
    }
}

TEST(DenseSystem, NothingFromWhatIsNotFinite) {
  Eigen::MatrixXd H = symmetric(5, false);
  H(2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(solve_symmetric(H, Eigen::VectorXd::Ones(5)));
  EXPECT_FALSE(invert_symmetric(H));
  EXPECT_FALSE(solve_and_invert_symmetric(H, Eigen::VectorXd::Ones(5)));
}

}  // namespace dense_system_test
}  // namespace fbvins
