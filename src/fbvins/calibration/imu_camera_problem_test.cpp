// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_problem.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/support/imu_camera_scene.hpp"

namespace fbvins {
namespace imu_camera_problem_test {

/// A short path with two cameras, everything estimated, at a state that fits nothing.
ImuCameraProblem wild_problem() {
  Rng rng(3);
  std::vector<Pose<T, B>> knots;
  for (int k = 0; k < 14; ++k)
    knots.push_back({(Quat(0, 1, 0, 0) * so3_exp(test::random_vector(rng, 0.05))).normalized(),
                     Vec3(Vec3(0.2, 0.3, 0.8) + test::random_vector(rng, 0.002))});
  CalibrationState state{.path = PoseSpline(0.05, knots), .intervals_per_bias = 4, .biases = {}, .T_BC = {}, .axes = {}};
  for (int n = 0; n < 4; ++n) state.biases.push_back({test::random_vector(rng, 0.01), test::random_vector(rng, 0.1)});
  for (int c = 0; c < 2; ++c) state.T_BC.push_back({so3_exp(test::random_vector(rng, 0.1)), test::random_vector(rng, 0.05)});
  state.time_offset_s = 0.004, state.line_delay_s = 2e-5, state.gravity_T = Vec3(0.3, -9.7, 0.2), state.board_scale = 1.02;
  state.axes.gyro += 0.01 * Mat3{{1, 2, -1}, {0, 1, 1}, {-2, 0, 1}};
  state.axes.accel += 0.01 * Mat3{{1, 0, 0}, {-1, 2, 0}, {1, 1, -1}};
  CalibrationData data;
  data.cameras = {test::wide_camera(), test::wide_camera()};
  const Board board;
  for (int v = 0; v < 6; ++v) {
    CalibrationView view{.camera = v % 2, .t_s = 0.05 * v + 0.02, .row = -40, .corners = {}};
    for (int i = v; i < 140; i += 20)
      view.corners.push_back({i, board.corner(i), Vec2(300 + 10 * rng.normal(), 240 + view.row), view.row});  // one row: exact
    data.views.push_back(view);
  }
  for (int i = 0; i < 60; ++i)
    data.readings.push_back({0.0071 * i, test::random_vector(rng, 0.3), Vec3(Vec3(0, 9, 2) + test::random_vector(rng, 0.5))});
  CalibrationSetup setup;
  setup.corner_sigma_px = 5, setup.gyro_sigma_radps = 0.1, setup.accel_sigma_mps2 = 1, setup.corner_huber = 10,
  setup.reading_huber = 3;
  setup.gyro_walk_radps2_rthz = 0.1, setup.accel_walk_mps3_rthz = 1, setup.gravity_sigma_mps2 = 1;
  setup.camera_sigma_m = 0.05, setup.camera_sigma_rad = 0.2;
  setup.T_CnC0 = {{}, {so3_exp(Vec3(0.1, 0.2, -0.1)), Vec3(-0.1, 0.02, 0.01)}};
  setup.free_axes = setup.free_board_scale = setup.free_line_delay = true;
  return {std::move(data), std::move(state), std::move(setup)};
}

TEST(ImuCameraProblem, TheGradientIsThatOfFiniteDifferences) {
  ImuCameraProblem problem = wild_problem();
  problem.linearise();
  const Eigen::VectorXd gradient = problem.gradient();
  for (int i = 0; i < gradient.size(); ++i) {
    // Times are multiplied by fast motions, the line delay by rows as well.
    const double step = i == problem.layout().time_offset || i == problem.layout().line_delay ? 1e-8 : 1e-6;
    const auto at = [&](double x) { return problem.cost_after(x * Eigen::VectorXd::Unit(gradient.size(), i)); };
    const double numeric = (at(step) - at(-step)) / (2 * step);
    EXPECT_NEAR(gradient(i), numeric, 2e-5 * (std::abs(numeric) + 10))
        << "unknown " << i << ", calibration from " << problem.layout().begin;
  }
}

TEST(ImuCameraProblem, AStepLowersTheCostAsPromised) {
  ImuCameraProblem problem = wild_problem();
  const double before = problem.linearise();
  ASSERT_TRUE(problem.solve(10));
  const double after = problem.apply_step();
  EXPECT_LT(after, before);
  EXPECT_GT(problem.predicted_decrease(), 0);
  problem.undo_step();
  EXPECT_DOUBLE_EQ(problem.linearise(), before);
}

}  // namespace imu_camera_problem_test
}  // namespace fbvins
