// SPDX-License-Identifier: Apache-2.0
// Every factor of the test's window, by the same test; and the test with factors that are wrong.
#include <gtest/gtest.h>

#include "fbvins/estimator/factor_test.hpp"
#include "fbvins/estimator/window_marginalisation.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace factors_test {

using test::unsound;

/// Of an own variable and the height of a frame; with a slope that may be wrong, or a variable that it does not name.
struct Level : Factor {
  FrameId frame;
  int number;
  double slope = 1;
  bool names_own = true;
  Level(FrameId f, int n) : frame(f), number(n) {}
  std::string_view name() const override { return "level"; }
  std::vector<Variable> variables() const override {
    std::vector<Variable> out{Variable::pose_of(frame)};
    if (names_own) out.push_back(Variable::own_one(number));
    return out;
  }
  double residual(const WindowProblem& w) const {
    return 10 * (w.frame(frame).state.T_FB.p.z() - w.own_variable(number).value(0));
  }
  double cost(const WindowProblem& w) const override { return 0.5 * residual(w) * residual(w); }
  double linearise(const WindowProblem& w, NormalEquations& out) const override {
    const int pose = row_of(w, out.layout, Variable::pose_of(frame)) + 2, own = row_of(w, out.layout, Variable::own_one(number));
    const double r = residual(w);
    out.g(pose) += slope * 10 * r, out.g(own) -= 10 * r;
    out.H(pose, pose) += 100, out.H(own, own) += 100, out.H(pose, own) -= 100;
    return 0.5 * r * r;
  }
  std::shared_ptr<const Factor> without(const DroppedFrame&) const override { return nullptr; }
};

WindowProblem window_with_level(int own_size = 1) {
  WindowProblem p = test::make_window(false).problem;
  p.own = {{4, "other", Eigen::VectorXd::Zero(3)}, {7, "level", Eigen::VectorXd::Constant(own_size, 0.3)}};
  return p;
}

TEST(Factors, AllOfTheWindowAreSound) {
  const WindowProblem p = test::make_window(false).problem;
  for (const auto& factor : p.factors) test::expect_sound(*factor, p);
  EXPECT_GE(p.factors.size(), 7u);
}

TEST(Factors, AlsoWhereTheTiltIsNotEstimated) {
  WindowProblem p = test::make_window(false).problem;
  p.weights.estimate_tilt = false;
  for (const auto& factor : p.factors) test::expect_sound(*factor, p);
}

TEST(Factors, TheTestFindsAWrongSlopeAndAVariableThatIsNotNamed) {
  const WindowProblem p = window_with_level();
  Level level(FrameId{2}, 7);
  EXPECT_EQ(unsound(level, p), "");
  level.slope = 1.001;
  EXPECT_NE(unsound(level, p), "");
  level.slope = 1, level.names_own = false;
  EXPECT_NE(unsound(level, p), "");
}

TEST(Factors, AnOwnVariableStaysInThePriorWhileAFactorNamesItOrItIsWanted) {
  WindowProblem p = window_with_level();
  p.own[0].is_wanted = true;
  for (const auto& [frame, number] : {std::pair{0, 7}, std::pair{3, 7}})
    p.factors.push_back(std::make_shared<const Level>(FrameId{frame}, number));
  MarginalisationMemory memory;
  const WindowPrior first = marginalise_frame(p, 0, {}, memory).prior;
  EXPECT_EQ(first.own, (std::vector<int>{7})) << "nothing has measured the other one";
  EXPECT_EQ(first.quadratic.size(), first.frames_row() + 15 * static_cast<int>(first.frames.size()));
  p.factors.pop_back();
  EXPECT_TRUE(marginalise_frame(p, 0, {}, memory).prior.own.empty()) << "nothing names it any more";
  p.own[1].is_wanted = true;
  EXPECT_EQ(marginalise_frame(p, 0, {}, memory).prior.own, (std::vector<int>{7}));
}

/// The prior is the quadratic that the factors were, seen from another origin.
TEST(Factors, APriorWithAnOwnVariableHasTheGradientOfItsFactors) {
  WindowProblem p = window_with_level();
  p.own[1].is_wanted = true;
  p.prior = {};
  p.landmarks.clear();
  p.observations.clear();
  p.factors = {std::make_shared<const Level>(FrameId{0}, 7)};
  NormalEquations before = test::empty_equations(p);
  p.prior.quadratic.H = 1e4 * Eigen::MatrixXd::Identity(15, 15);
  p.prior.quadratic.g = Eigen::VectorXd::Zero(15);
  p.prior.frames = {0};
  p.frames[0].in_prior = true;
  MarginalisationMemory memory;
  const WindowPrior prior = marginalise_frame(p, 0, {}, memory).prior;
  ASSERT_EQ(prior.own, (std::vector<int>{7}));
  // The frame's height is known to 1e-2, the level above it to 0.1: the variance of the level is their sum.
  const double information = 1 / (1e-4 + 1e-2), z = p.frames[0].state.T_FB.p.z();
  const int row = prior.own_row();
  EXPECT_NEAR(prior.quadratic.H(row, row), information, 1e-6 * information);
  const double at_truth = prior.quadratic.gradient(z * Eigen::VectorXd::Unit(prior.quadratic.size(), row))(row);
  EXPECT_NEAR(at_truth, 0, 1e-6 * information);
}

}  // namespace factors_test
}  // namespace fbvins
