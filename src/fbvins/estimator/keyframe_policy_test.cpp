// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/keyframe_policy.hpp"

#include <gtest/gtest.h>

#include "fbvins/estimator/estimator.hpp"
#include "fbvins/estimator/simulated_flight.hpp"

namespace fbvins {
namespace {

/// A window in the middle of a simulated flight.
struct MidFlight {
  test::SimulatedFlight flight{test::Motion(0.6, 0.3), 21};
  Estimator estimator{flight.rig, EstimatorOptions{}};
  WindowProblem problem;
  WindowSolver solver;
  int keyframes = 0;

  MidFlight() {
    for (int k = 0; k < 100; ++k) (void)estimator.process(flight.frame(k));
    estimator.window().fill_problem(estimator.calibration(), problem);
    keyframes = static_cast<int>(problem.frames.size()) - KeyframeOptions{}.newest_frames;
  }
};

TEST(KeyframePolicy, ObservationsOfAKeyframeNeverRaiseTheEntropy) {
  MidFlight m;
  const double all = entropy_of_newest(m.problem, -1, m.solver);
  for (int i = 0; i < m.keyframes; ++i) EXPECT_GE(entropy_of_newest(m.problem, i, m.solver), all - 1e-9) << i;
}

TEST(KeyframePolicy, AKeyframeThatSharesNoLandmarkHasNoInformationAndLeaves) {
  MidFlight m;
  const int outdated = 2;
  for (WindowLandmark& l : m.problem.landmarks) {
    const int first = l.first_observation;
    for (int k = 0; k < l.observation_count; ++k)  // as if it had looked the other way
      if (m.problem.observations[first + k].frame == outdated) m.problem.observations[first + k].sqrt_information.setZero();
  }
  const double all = entropy_of_newest(m.problem, -1, m.solver);
  EXPECT_NEAR(entropy_of_newest(m.problem, outdated, m.solver), all, 1e-6);
  EXPECT_EQ(least_informative_keyframe(m.problem, m.keyframes, m.solver), outdated);
}

TEST(KeyframePolicy, OldestIsTheFirst) {
  MidFlight m;
  EXPECT_EQ(KeyframePolicy(KeyframeOptions{}, 450).leaving(m.estimator.window(), m.estimator.calibration(), m.keyframes), 0);
}

TEST(KeyframePolicy, StandingStillMakesNoKeyframes) {
  MidFlight m;
  EXPECT_FALSE(KeyframePolicy(KeyframeOptions{}, 450).is_keyframe(m.estimator.window(), m.estimator.calibration(), true));
}

}  // namespace
}  // namespace fbvins
