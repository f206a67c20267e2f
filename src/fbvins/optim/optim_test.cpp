// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <numeric>

#include "fbvins/core/rng.hpp"
#include "fbvins/optim/levenberg_marquardt.hpp"
#include "fbvins/optim/quadratic_prior.hpp"
#include "fbvins/optim/robust_loss.hpp"
#include "fbvins/optim/schur.hpp"

namespace fbvins {
namespace {

Eigen::MatrixXd random_matrix(int rows, int cols, Rng& rng) {
  Eigen::MatrixXd m(rows, cols);
  for (double& x : m.reshaped()) x = rng.normal();
  return m;
}

TEST(Huber, IsQuadraticInsideLinearOutsideAndSmoothBetween) {
  EXPECT_DOUBLE_EQ(huber(1.0, 2.0).cost, 0.5);
  EXPECT_DOUBLE_EQ(huber(1.0, 2.0).weight, 1.0);
  EXPECT_DOUBLE_EQ(huber(100.0, 2.0).cost, 2.0 * (10 - 1));
  EXPECT_DOUBLE_EQ(huber(100.0, 2.0).weight, 0.2);
  const double h = 1e-6;
  EXPECT_NEAR(huber(4 + h, 2.0).cost, huber(4 - h, 2.0).cost, 2e-6);
  EXPECT_NEAR(huber(4 + h, 2.0).weight, huber(4 - h, 2.0).weight, 1e-6);
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

/// Rosenbrock's valley as two residuals: (1 - x, 10 (y - x^2)).
struct Rosenbrock {
  Eigen::Vector2d x{-1.2, 1.0}, saved, step;
  Eigen::Matrix2d H;
  Eigen::Vector2d g, d;

  Eigen::Vector2d residual() const { return {1 - x(0), 10 * (x(1) - x(0) * x(0))}; }
  double cost() const { return 0.5 * residual().squaredNorm(); }
  double linearise() {
    Eigen::Matrix2d J;
    J << -1, 0, -20 * x(0), 10;
    H = J.transpose() * J;
    g = J.transpose() * residual();
    return cost();
  }
  bool solve(double lambda) {
    d = lambda * H.diagonal();
    step = -(H + Eigen::Matrix2d(d.asDiagonal())).ldlt().solve(g);
    return step.allFinite();
  }
  double predicted_decrease() const { return 0.5 * (step.dot(d.cwiseProduct(step)) - g.dot(step)); }
  double step_size() const { return step.norm(); }
  double apply_step() {
    saved = x;
    x += step;
    return cost();
  }
  void undo_step() { x = saved; }
};

TEST(LevenbergMarquardt, FindsTheEndOfRosenbrocksValley) {
  Rosenbrock problem;
  const LmSummary summary =
      minimise(problem, {.max_iterations = 100, .initial_lambda = 1e-4, .min_step = 1e-12, .min_decrease = 0});
  EXPECT_TRUE(summary.usable);
  EXPECT_LT((problem.x - Eigen::Vector2d(1, 1)).norm(), 1e-6);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
}

TEST(LevenbergMarquardt, NeverEndsWorseThanItBegan) {
  for (int iterations = 1; iterations < 6; ++iterations) {
    Rosenbrock problem;
    const double before = problem.cost();
    const LmSummary summary = minimise(problem, {.max_iterations = iterations});
    EXPECT_LE(problem.cost(), before);
    EXPECT_LE(summary.iterations, iterations);
  }
}

struct Broken : Rosenbrock {
  double linearise() { return std::numeric_limits<double>::quiet_NaN(); }
};

TEST(LevenbergMarquardt, SaysWhenTheCostIsNotANumber) {
  Broken problem;
  EXPECT_FALSE(minimise(problem, {}).usable);
}

}  // namespace
}  // namespace fbvins
