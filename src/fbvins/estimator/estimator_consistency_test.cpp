// SPDX-License-Identifier: Apache-2.0
// Statistics over many simulated flights: whether the estimator's covariance is true, and what re-observed landmarks bring.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/estimated_flight.hpp"

namespace fbvins {
namespace estimator_consistency_test {

using test::EstimatedFlight;
using test::exact_noise;
using test::fly;
using test::FourCameras;
using test::Motion;
using test::normalised_error;
using test::SimulatedFlight;

/// Mean over flights and times of a chi-square variable with six degrees of freedom.
double mean_normalised_error(bool known_landmarks) {
  double sum = 0;
  int n = 0;
  for (int seed = 0; seed < 12; ++seed) {
    SimulatedFlight flight(Motion(0.6, 0.3), 100 + seed);
    EstimatorOptions options = exact_noise();
    options.known_landmarks.enabled = known_landmarks;
    const EstimatedFlight flown = fly(flight, 160, options);
    const int first = flown.first_pose();
    EXPECT_GE(first, 0) << seed;
    for (int k = std::max(first, 0); k < 160; k += 20, ++n) sum += normalised_error(flown, k);
  }
  return sum / n;
}

TEST(Estimator, CovarianceIsConsistent) {
  // 6 when consistent, 3.1 here: flights start when the window is full, and the gauge is then known better than it says.
  const double nees = mean_normalised_error(false);
  EXPECT_GT(nees, 2.5);
  EXPECT_LT(nees, 9.0);
}

TEST(Estimator, CovarianceIsNotOverconfidentWithLandmarksKnown) {
  // A landmark that leaves while in view is re-observed at once: its earlier observations count twice, and the covariance
  // allows for that (K4), even where it hardly matters.
  const double nees = mean_normalised_error(true);
  EXPECT_GT(nees, 1.5);
  EXPECT_LT(nees, 6.0);
}

TEST(Estimator, ReobservedLandmarksReduceTheDrift) {
  double with = 0, without = 0, nees = 0;
  int n = 0;
  for (int seed = 0; seed < 4; ++seed) {
    for (const bool known : {true, false}) {
      SimulatedFlight flight(Motion(0.8, 0.8), 200 + seed);
      flight.reobserves = true;
      flight.max_features = 60;
      EstimatorOptions options = exact_noise();
      options.known_landmarks.enabled = known;
      EstimatedFlight flown = fly(flight, 600, options);
      for (int k = 300; known && k < 600; k += 20, ++n) nees += normalised_error(flown, k);
      flown.gauge_frame = 200;  // drift after the start only
      flown.gauge_pose = flown.odometry[200].T_WB;
      for (int k = 300; k < 600; k += 20) (known ? with : without) += flown.position_error(k);
    }
  }
  EXPECT_LT(with, 0.5 * without);
  // Here points are re-observed exactly; the prior allows for patches that are not quite the same (6 when consistent).
  EXPECT_GT(nees / n, 1.5);
  EXPECT_LT(nees / n, 8.0);
}

TEST(Estimator, FourCamerasAreBetterThanTwo) {
  double of_four = 0, of_two = 0;
  for (const std::uint64_t seed : {21, 22, 23}) {
    FourCameras four(Motion(0.6, 0.3), seed);
    SimulatedFlight two(Motion(0.6, 0.3), seed);
    const EstimatedFlight with_four = fly(four, 300), with_two = fly(two, 300);
    EXPECT_EQ(with_four.odometry.back().health, (Health{HealthState::good, HealthReason::none}));
    for (int k = 100; k < 300; ++k) of_four += with_four.position_error(k), of_two += with_two.position_error(k);
  }
  EXPECT_LT(of_four, 0.9 * of_two);
}

}  // namespace estimator_consistency_test
}  // namespace fbvins
