// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace window_solver_test {

TEST(WindowSolver, CovariancesAreTheInverseOfTheInformation) {
  const test::Window w = test::make_window(false);
  WindowSolver solver;
  WindowInformation information;
  EXPECT_FALSE(information.covariance(0).has_value()) << "nothing factorised";
  solver.linearise(w.problem);
  ASSERT_TRUE(solver.step(0, information));
  PairTable pairs;
  NormalEquations equations;
  linearise(w.problem, pairs, equations);
  const Eigen::MatrixXd inverse = reduced(equations).H.inverse();
  const WindowLayout& at = equations.layout;
  for (int f = 0; f < test::kFrames; ++f) {
    const std::optional<Mat17> covariance = information.covariance(f);
    ASSERT_TRUE(covariance.has_value());
    for (int a = 0; a < 15; ++a) {
      EXPECT_NEAR((*covariance)(a, a) / inverse(at.row_of(f, a), at.row_of(f, a)), 1, 1e-4) << f << ' ' << a;
      EXPECT_NEAR((*covariance)(a, 15), inverse(at.row_of(f, a), at.tilt_row()),
                  1e-4 * std::sqrt((*covariance)(a, a) * (*covariance)(15, 15)));
    }
  }
}

TEST(WindowSolver, DampingDoesNotShrinkCovariances) {
  WindowSolution gentle, damped;
  gentle.window = damped.window = test::make_window(false).problem;
  WindowSolver solver;
  solver.solve(gentle, {.max_iterations = 30, .min_decrease = 0});
  damped.window = gentle.window;
  solver.solve(damped, {.max_iterations = 1, .initial_lambda = 1e3});
  const double variance = (*gentle.covariance(gentle.window.frames[5].id))(0, 0);
  EXPECT_NEAR((*damped.covariance(gentle.window.frames[5].id))(0, 0) / variance, 1, 1e-3);
  EXPECT_FALSE(gentle.covariance(FrameId{99}).has_value()) << "not in the window";
}

TEST(WindowSolver, ASolutionIsNoWorseThanTheStart) {
  for (int iterations = 1; iterations < 4; ++iterations) {
    WindowSolution solution;
    solution.window = test::make_window(true).problem;
    PairTable pairs;
    const double before = cost_of(solution.window, pairs);
    WindowSolver().solve(solution, {.max_iterations = iterations});
    EXPECT_TRUE(solution.summary.usable);
    EXPECT_LT(cost_of(solution.window, pairs), before);
    EXPECT_DOUBLE_EQ(solution.summary.initial_cost, before);
  }
}

TEST(WindowSolver, TheRenewedGradientIsThatOfALinearisation) {
  const test::Window w = test::make_window(false);
  PairTable pairs;
  NormalEquations equations;
  const double cost = linearise(w.problem, pairs, equations);
  WindowGradient gradient;
  EXPECT_NEAR(gradient_of(w.problem, pairs, gradient) / cost, 1, 1e-12);
  EXPECT_LT((gradient.dense - equations.g).norm() / equations.g.norm(), 1e-12);
  ASSERT_EQ(gradient.landmarks.size(), equations.points.points().size());
  for (std::size_t i = 0; i < gradient.landmarks.size(); ++i) {
    const Vec3& expected = equations.points.points()[i].w;
    EXPECT_LT((gradient.landmarks[i] - expected).norm(), 1e-10 * (1 + expected.norm())) << i;
  }
}

TEST(WindowSolver, MostSolvesLineariseOnce) {
  WindowSolution anew, kept;
  anew.window = kept.window = test::make_window(false).problem;
  WindowSolver solver;
  solver.solve(anew, {.max_iterations = 20, .min_decrease = 1e-3, .max_followed = 0});
  solver.solve(kept, {.max_iterations = 20, .min_decrease = 1e-3});
  EXPECT_LT(kept.summary.iterations, anew.summary.iterations);
  EXPECT_NEAR(kept.summary.final_cost / anew.summary.final_cost, 1, 1e-4);
  PairTable pairs;
  EXPECT_NEAR(cost_of(kept.window, pairs) / anew.summary.final_cost, 1, 1e-4);
}

TEST(WindowSolver, ReusedMemoryGivesTheSameBits) {
  WindowSolution one, two;
  one.window = two.window = test::make_window(false).problem;
  WindowSolver used, fresh;
  WindowSolution other;
  other.window = test::make_window(true).problem;
  used.solve(other, {});
  used.solve(one, {});
  fresh.solve(two, {});
  for (int f = 0; f < test::kFrames; ++f) EXPECT_EQ(one.window.frames[f].state.T_FB.p, two.window.frames[f].state.T_FB.p);
}

}  // namespace window_solver_test
}  // namespace fbvins
