// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/quadratic_prior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace quadratic_prior_test {

Eigen::MatrixXd random_matrix(int rows, int cols, Rng& rng) {
  Eigen::MatrixXd m(rows, cols);
  for (double& x : m.reshaped()) x = rng.normal();
  return m;
}

TEST(Marginalise, KeepsTheMinimumAndTheCovarianceOfWhatStays) {
  Rng rng(1);
  const Eigen::MatrixXd J = random_matrix(30, 9, rng);
  const Eigen::MatrixXd H = J.transpose() * J;
  const Eigen::VectorXd g = random_matrix(9, 1, rng);
  const std::vector<int> keep{7, 0, 3, 4}, drop{1, 2, 5, 6, 8};
  const QuadraticPrior prior = marginalise(H, g, keep, drop);
  const Eigen::VectorXd x = -H.ldlt().solve(g);
  const Eigen::MatrixXd covariance = H.inverse();
  const Eigen::VectorXd y = -prior.H.ldlt().solve(prior.g);
  const Eigen::MatrixXd small = prior.H.inverse();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(y(i), x(keep[i]), 1e-10);
    for (int j = 0; j < 4; ++j) EXPECT_NEAR(small(i, j), covariance(keep[i], keep[j]), 1e-10);
  }
}

TEST(Marginalise, DirectionsWithoutInformationPassNothingOn) {
  // Two variables to drop, of which only the sum is measured against the one that stays.
  Eigen::MatrixXd J(2, 3);
  J << 1, 1, 1, 1, 0, 0;
  const Eigen::MatrixXd H = J.transpose() * J;
  const QuadraticPrior prior = marginalise(H, Eigen::Vector3d(1, 1, 1), {0}, {1, 2});
  EXPECT_NEAR(prior.H(0, 0), 1, 1e-9) << "only the second row still says something about the first variable";
  EXPECT_TRUE(prior.g.allFinite());
}

TEST(Marginalise, ShiftingKeepsTheCostUpToAConstant) {
  Rng rng(2);
  const Eigen::MatrixXd J = random_matrix(8, 4, rng);
  const QuadraticPrior prior{J.transpose() * J, random_matrix(4, 1, rng)};
  const Eigen::VectorXd by = random_matrix(4, 1, rng), a = random_matrix(4, 1, rng), b = random_matrix(4, 1, rng);
  const QuadraticPrior moved = shifted(prior, by);
  EXPECT_NEAR(moved.cost(a - by) - moved.cost(b - by), prior.cost(a) - prior.cost(b), 1e-10);
}

}  // namespace quadratic_prior_test
}  // namespace fbvins
