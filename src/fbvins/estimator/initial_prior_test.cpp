// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/initial_prior.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace initial_prior_test {

NavState<G> tilted() {
  NavState<G> s;
  s.T_FB = {so3_exp(Vec3(0.4, -0.3, 1.0)), Vec3(1, 2, 3)};
  s.bias = {Vec3(0.01, 0.02, -0.01), Vec3(0.1, -0.05, 0.02)};
  return s;
}

/// Cost of turning the frame by a small angle about an axis of G; G's tilt stays.
double cost_of_turn(const WindowPrior& prior, const Vec3& angle_G) {
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(prior.quadratic.size());
  dx.segment<3>(prior.frames_row() + nav::theta) = tilted().T_FB.q.conjugate() * angle_G;
  return prior.quadratic.cost(dx) - prior.quadratic.cost(Eigen::VectorXd::Zero(prior.quadratic.size()));
}

TEST(FirstFramePrior, FixesTheFrameAndLeavesTheTiltFree) {
  const WindowPrior prior = first_frame_prior(tilted(), unknown_biases());
  EXPECT_EQ(prior.quadratic.size(), 17);
  for (int axis = 0; axis < 3; ++axis) EXPECT_GT(cost_of_turn(prior, 0.01 * Vec3::Unit(axis)), 40);
  Eigen::VectorXd tilt = Eigen::VectorXd::Zero(17);
  tilt(0) = 0.01;
  EXPECT_LT(prior.quadratic.cost(tilt), 1e-3);
}

TEST(FirstFramePrior, HasBiasesNearZeroAndNotNearTheInitialSolution) {
  const WindowPrior prior = first_frame_prior(tilted(), unknown_biases());
  Eigen::VectorXd to_zero = Eigen::VectorXd::Zero(17);
  to_zero.tail<6>() << -tilted().bias.gyro_radps, -tilted().bias.accel_mps2;
  EXPECT_LT(prior.quadratic.cost(to_zero), prior.quadratic.cost(Eigen::VectorXd::Zero(17)));
  EXPECT_LT(prior.quadratic.gradient(to_zero).norm(), 1e-9) << "the minimum";
}

TEST(FirstFramePrior, HasTheBiasesOfAnEarlierFlight) {
  ImuBiasEstimate before;
  before.bias = {Vec3(0.02, 0, 0.01), Vec3(0.3, 0.1, -0.2)};
  before.gyro_covariance = 1e-6 * Mat3::Identity();
  before.accel_covariance = Vec3(1e-4, 4e-4, 1e-4).asDiagonal();
  const WindowPrior prior = first_frame_prior(tilted(), before);
  Eigen::VectorXd there = Eigen::VectorXd::Zero(17);
  there.tail<6>() << before.bias.gyro_radps - tilted().bias.gyro_radps, before.bias.accel_mps2 - tilted().bias.accel_mps2;
  EXPECT_LT(prior.quadratic.gradient(there).norm(), 1e-9) << "the minimum";
  Eigen::VectorXd a_sigma_off = there;
  a_sigma_off(2 + nav::ba + 1) += 0.02;
  EXPECT_NEAR(prior.quadratic.cost(a_sigma_off) - prior.quadratic.cost(there), 0.5, 1e-9);
}

TEST(CalibrationPrior, ComesBetweenTiltAndFrame) {
  const WindowPrior frame = first_frame_prior(tilted(), unknown_biases());
  const Calibration calibrated{{{Quat::Identity(), Vec3(0.1, 0, 0)}, {Quat::Identity(), Vec3(0.2, 0, 0)}}};
  const WindowPrior prior = with_calibration_prior(frame, CalibrationPrior{}, calibrated);
  EXPECT_EQ(prior.calibration_row(), kTiltSize);
  EXPECT_EQ(prior.frames_row(), kTiltSize + kCalibrationSize);
  EXPECT_EQ(prior.quadratic.H.bottomRightCorner(15, 15), frame.quadratic.H.bottomRightCorner(15, 15));
  EXPECT_EQ(prior.quadratic.H.topLeftCorner(2, 2), frame.quadratic.H.topLeftCorner(2, 2));
  EXPECT_EQ(prior.quadratic.g.tail(15), frame.quadratic.g.tail(15));
}

}  // namespace initial_prior_test
}  // namespace fbvins
