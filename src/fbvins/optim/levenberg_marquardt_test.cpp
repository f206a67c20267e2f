// SPDX-License-Identifier: Apache-2.0
#include "fbvins/optim/levenberg_marquardt.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <limits>

namespace fbvins {
namespace levenberg_marquardt_test {

/// The Rosenbrock function as two residuals: (1 - x, 10 (y - x^2)).
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

TEST(LevenbergMarquardt, FindsTheMinimumOfTheRosenbrockFunction) {
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

/// Steps again with the information of the last linearisation.
struct Keeping : Rosenbrock {
  bool step_again() {
    Eigen::Matrix2d J;
    J << -1, 0, -20 * x(0), 10;
    g = J.transpose() * residual();
    step = -(H + Eigen::Matrix2d(d.asDiagonal())).ldlt().solve(g);
    return step.allFinite();
  }
  void move() {
    saved = x;
    x += step;
  }
};

TEST(LevenbergMarquardt, StepsWithKeptInformationEndAtTheSameMinimum) {
  Keeping problem;
  problem.x = {0.9, 0.85};
  const LmSummary summary =
      minimise(problem, {.max_iterations = 100, .initial_lambda = 1e-9, .min_step = 1e-12, .min_decrease = 0});
  EXPECT_TRUE(summary.usable);
  EXPECT_LT((problem.x - Eigen::Vector2d(1, 1)).norm(), 1e-6);
  EXPECT_GT(summary.followed, 0);
}

TEST(LevenbergMarquardt, LinearisesAgainOnlyAfterLongSteps) {
  LmOptions options{.max_iterations = 100, .initial_lambda = 1e-9, .min_step = 1e-12, .min_decrease = 0};
  Keeping all;
  all.x = {0.9, 0.85};
  EXPECT_GT(minimise(all, options).iterations, 1);
  options.worth_linearising = 1;
  Keeping one;
  one.x = {0.9, 0.85};
  const LmSummary summary = minimise(one, options);
  EXPECT_EQ(summary.iterations, 1);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
}

TEST(LevenbergMarquardt, ANegligibleStepIsMadeWithoutEvaluatingIt) {
  struct Counting : Keeping {
    int evaluated = 0;
    double apply_step() { return ++evaluated, Keeping::apply_step(); }
  } problem;
  problem.x = {0.9, 0.85};
  const LmSummary summary = minimise(problem, {.max_iterations = 10, .initial_lambda = 1e-9, .min_decrease = 1e-3});
  EXPECT_EQ(problem.evaluated, summary.iterations + summary.followed);
  EXPECT_NEAR(problem.cost(), summary.final_cost, 1e-3);
}

struct Broken : Rosenbrock {
  double linearise() { return std::numeric_limits<double>::quiet_NaN(); }
};

TEST(LevenbergMarquardt, SaysWhenTheCostIsNotANumber) {
  Broken problem;
  EXPECT_FALSE(minimise(problem, {}).usable);
}

}  // namespace levenberg_marquardt_test
}  // namespace fbvins
