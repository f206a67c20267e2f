// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_equations.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "tests/support/jacobian_check.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace window_equations_test {

using test::kFrames;

/// The window moved by a step of the dense system, without calibration.
WindowProblem moved(const WindowProblem& window, const Eigen::VectorXd& d) {
  WindowProblem out = window;
  const WindowLayout at(window);
  out.tilt.angle_rad += d.segment<2>(at.tilt_row());
  for (int f = 0; f < kFrames; ++f) {
    Vec15 d_frame;
    for (int k = 0; k < 15; ++k) d_frame(k) = d(at.row_of(f, k));
    out.frames[f].state = out.frames[f].state.boxplus(d_frame);
  }
  return out;
}

TEST(WindowEquations, GradientIsTheDerivativeOfTheCost) {
  const test::Window w = test::make_window(false);
  PairTable pairs;
  NormalEquations equations;
  EXPECT_NEAR(linearise(w.problem, pairs, equations), cost_of(w.problem, pairs), 1e-6);
  const auto cost = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, cost_of(moved(w.problem, d), pairs));
  };
  const auto check = check_jacobian(cost, equations.g.transpose(), {{"cost", 1}},
                                    {{"velocities and biases", 9 * kFrames}, {"tilt", 2}, {"poses", 6 * kFrames}}, 1e-6, 1e-5);
  EXPECT_TRUE(check.ok) << check.message;
}

/// A third camera, beside the second one, sees what that sees.
WindowProblem with_third_camera(WindowProblem w) {
  w.calibration.cameras.push_back(w.calibration.T_BC(1) * Pose<C0, C0>(Quat::Identity(), Vec3(0.01, -0.02, 0)));
  const std::vector<WindowObservation> by_two = std::exchange(w.observations, {});
  for (WindowLandmark& l : w.landmarks) {
    const auto begin = by_two.begin() + l.first_observation, end = begin + l.observation_count;
    l.first_observation = static_cast<int>(w.observations.size());
    for (auto o = begin; o != end; ++o) {
      w.observations.push_back(*o);
      if (o->camera == 1) w.observations.push_back(*o), w.observations.back().camera = 2;
    }
    l.observation_count = static_cast<int>(w.observations.size()) - l.first_observation;
  }
  return w;
}

TEST(WindowEquations, AnyNumberOfCamerasMaySeeALandmarkInAFrame) {
  const WindowProblem two = test::make_window(false).problem, three = with_third_camera(two);
  ASSERT_GT(three.observations.size(), 1.3 * static_cast<double>(two.observations.size()));
  PairTable pairs;
  NormalEquations equations;
  EXPECT_NEAR(linearise(three, pairs, equations), cost_of(three, pairs), 1e-6);
  const auto cost = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, cost_of(moved(three, d), pairs));
  };
  const auto check = check_jacobian(cost, equations.g.transpose(), {{"cost", 1}},
                                    {{"velocities and biases", 9 * kFrames}, {"tilt", 2}, {"poses", 6 * kFrames}}, 1e-6, 1e-5);
  EXPECT_TRUE(check.ok) << check.message;
}

TEST(WindowEquations, GradientOfLandmarksIsTheDerivativeOfTheCost) {
  const test::Window w = test::make_window(false);
  PairTable pairs;
  NormalEquations equations;
  linearise(w.problem, pairs, equations);
  for (std::size_t k = 0; k < w.problem.landmarks.size(); k += 7) {
    const auto cost = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      WindowProblem other = w.problem;
      other.landmarks[k].alpha_beta_rho += d;
      return Eigen::VectorXd::Constant(1, cost_of(other, pairs));
    };
    const auto check =
        check_jacobian(cost, equations.points.points()[k].w.transpose(), {{"cost", 1}}, {{"landmark", 3}}, 1e-6, 1e-5);
    EXPECT_TRUE(check.ok) << k << ": " << check.message;
  }
}

TEST(WindowEquations, LayoutCoversEveryRowOnce) {
  for (const bool calibrating : {false, true}) {
    const test::Window w = test::make_window(calibrating);
    const WindowLayout at(w.problem);
    std::vector<int> rows;
    for (int f = 0; f < kFrames; ++f)
      for (int k = 0; k < 15; ++k) rows.push_back(at.row_of(f, k));
    for (int k = 0; k < at.tilt_size; ++k) rows.push_back(at.tilt_row() + k);
    for (int k = 0; k < at.calibration_size; ++k) rows.push_back(at.calibration_row() + k);
    std::sort(rows.begin(), rows.end());
    for (int k = 0; k < at.size(); ++k) EXPECT_EQ(rows[static_cast<std::size_t>(k)], k);
    EXPECT_EQ(static_cast<int>(rows.size()), at.size());
  }
}

TEST(WindowEquations, CalibrationThatIsNotEstimatedIsDecoupled) {
  test::Window w = test::make_window(true);
  w.problem.weights.estimate_time_offset = false;
  PairTable pairs;
  NormalEquations equations;
  linearise(w.problem, pairs, equations);
  const int row = equations.layout.calibration_row() + kTimeOffsetIndex;
  EXPECT_EQ(equations.g(row), 0);
  EXPECT_EQ(equations.H(row, row), 1);
  EXPECT_TRUE(equations.H.row(row).head(row).isZero(0));
  bool line_delay_is_coupled = false;
  for (PointBlock& point : equations.points.points()) {
    EXPECT_TRUE(equations.points.coupling(point, 2).col(0).isZero(0));
    line_delay_is_coupled = line_delay_is_coupled || !equations.points.coupling(point, 2).col(1).isZero(0);
  }
  EXPECT_TRUE(line_delay_is_coupled);
}

TEST(WindowEquations, ASingularLandmarkDoesNotKeepTheOthersFromBeingEliminated) {
  const test::Window w = test::make_window(false);
  PairTable pairs;
  NormalEquations singular;
  linearise(w.problem, pairs, singular);
  PointBlock& first = singular.points.points().front();
  for (int k = 0; k < first.count; ++k) singular.points.coupling(first, k).setZero();
  first.w.setZero();
  first.V.setIdentity();
  NormalEquations regular = singular;
  first.V = Vec3(1, 2, 3) * Vec3(1, 2, 3).transpose();
  const ReducedEquations expected = reduced(regular), found = reduced(singular);
  EXPECT_LT((found.g - expected.g).norm(), 1e-3 * expected.g.norm());
  EXPECT_LT((found.H - expected.H).norm(), 1e-3 * expected.H.norm());
  EXPECT_GT((singular.H - expected.H).norm(), 1e-2 * expected.H.norm());
}

}  // namespace window_equations_test
}  // namespace fbvins
