// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/calibration_uncertainty.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace calibration_uncertainty_test {

TEST(ScaleUncertainty, IsAsLargeAsThatOfTheBaseline) {
  const Pose<B, C0> left{Quat::Identity(), Vec3(0.02, 0.055, 0.01)};
  const Pose<B, C1> right{Quat::Identity(), Vec3(0.02, -0.055, 0.01)};
  EXPECT_NEAR(scale_sigma(left.p, right.p), 0.0003 / 0.11, 1e-15);
}

TEST(ScaleUncertainty, ErrorsOfRandomScalesAreAsLargeAsItSays) {
  Rng rng(3);
  const Vec3 from_start(8, -3, 1);
  const double sigma = 0.003;
  Mat3 covariance = 1e-8 * Mat3::Identity();
  add_scale(from_start, sigma, covariance);
  const Mat3 information = covariance.inverse();
  double sum = 0;
  constexpr int kFlights = 4000;
  for (int i = 0; i < kFlights; ++i) {
    const Vec3 error = sigma * rng.normal() * from_start;
    sum += error.dot(information * error);
  }
  EXPECT_NEAR(sum / kFlights, 1, 0.08);  // one direction
}

TEST(AxisUncertainty, BiasesByCrookedAxesAreAsLargeAsItSays) {
  Rng rng(4);
  double sum = 0;
  constexpr int kSensors = 4000;
  for (int i = 0; i < kSensors; ++i) {
    Mat3 crooked;
    for (double& e : crooked.reshaped()) e = kAxisSigma * rng.normal();
    const Vec3 up(rng.normal(), 2, 1);
    const Vec3 bias = crooked * (9.81 * up.normalized());
    sum += bias.dot(axis_covariance(9.81).inverse() * bias);
  }
  EXPECT_NEAR(sum / kSensors, 3, 0.15);
}

}  // namespace calibration_uncertainty_test
}  // namespace fbvins
