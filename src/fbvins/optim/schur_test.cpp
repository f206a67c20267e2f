// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/schur.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace schur_test {

Eigen::MatrixXd random_matrix(int rows, int cols, Rng& rng) {
  Eigen::MatrixXd m(rows, cols);
  for (double& x : m.reshaped()) x = rng.normal();
  return m;
}

/// Points coupled to blocks of a dense system, and the same as one big dense system.
struct PointsAndDense {
  PointBlocks points;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(30, 30);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(30);
  Eigen::MatrixXd full;
  Eigen::VectorXd full_g;
};

PointsAndDense make_problem() {
  Rng rng(3);
  PointsAndDense out;
  const int n_points = 7, n = 30 + 3 * n_points;
  out.full = Eigen::MatrixXd::Zero(n, n);
  out.full_g = Eigen::VectorXd::Zero(n);
  const std::vector<std::vector<int>> seen{{0, 6, 12}, {6, 24}, {0}, {0, 12, 18, 24}, {18}, {12, 18, 24}, {0, 6, 12, 18, 24}};
  const Eigen::MatrixXd J0 = random_matrix(40, 30, rng);
  out.full.topLeftCorner(30, 30) = J0.transpose() * J0;
  for (int p = 0; p < n_points; ++p) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(20, n);
    for (int offset : seen[p]) J.middleCols(offset, 6) = random_matrix(20, 6, rng);
    J.middleCols(30 + 3 * p, 3) = random_matrix(20, 3, rng);
    const Eigen::VectorXd r = random_matrix(20, 1, rng);
    out.full += J.transpose() * J;
    out.full_g += J.transpose() * r;
    PointBlock& block = out.points.add(seen[p]);
    block.V = J.middleCols(30 + 3 * p, 3).transpose() * J.middleCols(30 + 3 * p, 3);
    block.w = J.middleCols(30 + 3 * p, 3).transpose() * r;
    for (std::size_t k = 0; k < seen[p].size(); ++k)
      out.points.coupling(block, static_cast<int>(k)) = J.middleCols(30 + 3 * p, 3).transpose() * J.middleCols(seen[p][k], 6);
  }
  out.H = out.full.topLeftCorner(30, 30);
  out.g = out.full_g.head(30);
  return out;
}

TEST(PointBlocks, EliminationIsTheDenseSchurComplement) {
  PointsAndDense p = make_problem();
  ASSERT_TRUE(p.points.eliminate(0, p.H, p.g));
  const int m = static_cast<int>(p.full_g.size()) - 30;
  const Eigen::MatrixXd V_inverse = p.full.bottomRightCorner(m, m).inverse();
  const Eigen::MatrixXd H =
      p.full.topLeftCorner(30, 30) - p.full.topRightCorner(30, m) * V_inverse * p.full.bottomLeftCorner(m, 30);
  const Eigen::VectorXd g = p.full_g.head(30) - p.full.topRightCorner(30, m) * V_inverse * p.full_g.tail(m);
  for (int c = 0; c < 30; ++c)
    for (int r = c; r < 30; ++r) EXPECT_NEAR(p.H(r, c), H(r, c), 1e-9) << r << ' ' << c;
  EXPECT_LT((p.g - g).norm(), 1e-9);
}

TEST(PointBlocks, BackSubstitutionCompletesTheDenseStep) {
  PointsAndDense p = make_problem();
  ASSERT_TRUE(p.points.eliminate(0, p.H, p.g));
  const Eigen::VectorXd step = -p.H.selfadjointView<Eigen::Lower>().llt().solve(p.g);
  std::vector<Eigen::Vector3d> point_steps;
  p.points.back_substitute(step, point_steps);
  const Eigen::VectorXd dense = -p.full.ldlt().solve(p.full_g);
  EXPECT_LT((step - dense.head(30)).norm(), 1e-9);
  for (std::size_t i = 0; i < point_steps.size(); ++i)
    EXPECT_LT((point_steps[i] - dense.segment<3>(30 + 3 * static_cast<int>(i))).norm(), 1e-9);
}

TEST(PointBlocks, RefusesAPointWithoutDepth) {
  PointBlocks points;
  const int offset[] = {0};
  points.add(offset).V = Eigen::Vector3d(1, 1, 0).asDiagonal();
  Eigen::MatrixXd H = Eigen::MatrixXd::Identity(6, 6);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(6);
  EXPECT_FALSE(points.eliminate(0, H, g));
}

}  // namespace schur_test
}  // namespace fbvins
