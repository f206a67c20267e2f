// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/state_uncertainty.hpp"

#include <gtest/gtest.h>

#include "fbvins/estimator/calibration_uncertainty.hpp"

namespace fbvins {
namespace state_uncertainty_test {

const Mat17 kWindow = 1e-6 * Mat17::Identity();

NavState<G> moving(double v_mps) {
  NavState<G> state;
  state.T_FB.p = Vec3(10, 0, 0);
  state.v_FB = Vec3(0, v_mps, 0);
  return state;
}

TEST(StateUncertainty, LengthsAreAsUncertainAsTheBaseline) {
  StateUncertainty uncertainty(0.003, false, 9.81);
  Odometry out;
  Tilt tilt;
  tilt.pivot = Vec3(2, 0, 0);
  Mat17 known_tilt = kWindow;
  known_tilt.bottomRightCorner<2, 2>().setZero();
  uncertainty.fill(known_tilt, moving(2), tilt, Vec3::Zero(), out);
  EXPECT_NEAR(out.pose_covariance(0, 0), 1e-6 + std::pow(0.003 * 8, 2), 1e-12) << "from where levelling begins";
  EXPECT_NEAR(out.pose_covariance(1, 1), 1e-6, 1e-12);
  EXPECT_NEAR(out.velocity_covariance(1, 1), 1e-6 + std::pow(0.003 * 2, 2), 1e-12);
  EXPECT_EQ(uncertainty.scale_sigma(), 0) << "the calibration's, which no flight shows";
}

TEST(StateUncertainty, AnUncertainTiltMovesWhatIsFarFromThePivot) {
  StateUncertainty uncertainty(0, false, 9.81);
  Odometry out;
  uncertainty.fill(kWindow, moving(0), {}, Vec3::Zero(), out);
  EXPECT_NEAR(out.pose_covariance(2, 2), 1e-6 * (1 + 100), 1e-9);
  EXPECT_GT(uncertainty.up_sigma_rad(), 0);
}

TEST(StateUncertainty, BiasesAreAsUncertainAsTheAxes) {
  StateUncertainty uncertainty(0, false, 9.81);
  Odometry out;
  uncertainty.fill(kWindow, moving(0), {}, Vec3(0, 0, 2), out);
  EXPECT_NEAR(out.gyro_bias_covariance(0, 0), 1e-6 + std::pow(2 * kAxisSigma, 2), 1e-12);
  EXPECT_NEAR(out.accel_bias_covariance(2, 2), 1e-6 + std::pow(9.81 * kAxisSigma, 2), 1e-12);
}

TEST(StateUncertainty, OneCamerasScaleIsRememberedFromTheLastMotion) {
  StateUncertainty uncertainty(0, true, 9.81);
  Odometry out;
  uncertainty.fill(kWindow, moving(0.1), {}, Vec3::Zero(), out);
  EXPECT_EQ(out.scale_sigma, 0) << "nothing has shown it";
  uncertainty.fill(kWindow, moving(1), {}, Vec3::Zero(), out);
  const double shown = out.scale_sigma;
  EXPECT_GT(shown, 0);
  uncertainty.fill(kWindow, moving(0.1), {}, Vec3::Zero(), out);
  EXPECT_EQ(out.scale_sigma, shown);
  uncertainty.fill(kWindow, moving(4), {}, Vec3::Zero(), out);
  EXPECT_LT(out.scale_sigma, 0.5 * shown) << "faster motion shows it better";
  uncertainty.restart();
  EXPECT_EQ(uncertainty.scale_sigma(), 0);
}

}  // namespace state_uncertainty_test
}  // namespace fbvins
