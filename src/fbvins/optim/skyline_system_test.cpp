// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/skyline_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace skyline_system_test {

constexpr int kChain = 40, kBorder = 3, kReach = 4;

struct Both {
  SkylineSystem skyline;
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
};

/// A chain whose unknowns meet the four before them, and three unknowns that meet all; the same, dense.
Both chain_with_border() {
  std::vector<int> first;
  for (int i = 0; i < kChain; ++i) first.push_back(std::max(0, i - kReach));
  first.insert(first.end(), kBorder, 0);
  Both both{SkylineSystem(first), Eigen::MatrixXd::Zero(kChain + kBorder, kChain + kBorder),
            Eigen::VectorXd::Zero(kChain + kBorder)};
  Rng rng(7);
  for (int i = 0; i + kReach < kChain; ++i) {
    const std::vector<int> index = {i + 3, i, kChain + 2, i + kReach, kChain, i + 1, kChain + 1};
    Eigen::MatrixXd J(9, index.size());
    Eigen::VectorXd r(9);
    for (double& x : J.reshaped()) x = rng.normal();
    for (double& x : r) x = rng.normal();
    both.skyline.add(index, J.transpose() * J, J.transpose() * r);
    both.H(index, index) += J.transpose() * J;
    both.b(index) += J.transpose() * r;
  }
  return both;
}

TEST(SkylineSystem, SolvesAsADenseFactorDoes) {
  Both both = chain_with_border();
  ASSERT_TRUE(both.skyline.factorise());
  EXPECT_LT((both.skyline.solve(both.skyline.b()) - both.H.llt().solve(both.b)).norm(), 1e-10);
  const Eigen::MatrixXd P = both.H.llt().solve(Eigen::MatrixXd::Identity(both.H.rows(), both.H.cols()));
  EXPECT_LT((both.skyline.inverse_tail(5) - P.bottomRightCorner(5, 5)).norm(), 1e-10);
}

TEST(SkylineSystem, DampsByTheDiagonal) {
  Both both = chain_with_border();
  ASSERT_TRUE(both.skyline.factorise(0.5));
  Eigen::MatrixXd H = both.H;
  H.diagonal() *= 1.5;
  EXPECT_LT((both.skyline.solve(both.skyline.b()) - H.llt().solve(both.b)).norm(), 1e-10);
}

TEST(SkylineSystem, SaysWhenNothingDeterminesAnUnknown) {
  Both both = chain_with_border();
  EXPECT_TRUE(both.skyline.factorise());
  both.skyline.set_zero();
  for (int i = 0; i + 1 < both.skyline.size(); ++i) both.skyline.add({i}, Eigen::MatrixXd::Ones(1, 1), Eigen::VectorXd::Zero(1));
  EXPECT_FALSE(both.skyline.factorise());
}

}  // namespace skyline_system_test
}  // namespace fbvins
