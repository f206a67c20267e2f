// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/keyframe_policy.hpp"

#include <gtest/gtest.h>

#include "fbvins/estimator/estimator.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace keyframe_policy_test {

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

/// The readings since the last keyframe are kept, so at rest there is one from time to time.
TEST(KeyframePolicy, AtRestOneInTenSeconds) {
  test::SimulatedFlight flight(test::Motion(0, 0), 5);
  Estimator estimator(flight.rig, EstimatorOptions{});
  int keyframes = 0, at_rest = 0;
  double longest_s = 0;
  const TrackedFrame view = flight.frame(0);
  for (int k = 0; k < 900; ++k) {
    TrackedFrame frame = k == 0 ? view : flight.frame(k);
    frame.features = view.features;
    const Odometry o = estimator.process(frame).odometry;
    keyframes += o.stats.keyframe, at_rest += o.stats.standstill;
    for (const Frame& f : estimator.window().frames())
      if (f.imu) longest_s = std::max(longest_s, f.imu->dt_s());
  }
  ASSERT_GT(at_rest, 800);
  EXPECT_GE(keyframes, 3);
  EXPECT_LE(keyframes, 4);
  EXPECT_GT(longest_s, 9);
  EXPECT_LT(longest_s, 10.5);
}

TEST(KeyframePolicy, StandingStillMakesNoKeyframes) {
  MidFlight m;
  EXPECT_FALSE(KeyframePolicy(KeyframeOptions{}, 450).is_keyframe(m.estimator.window(), m.estimator.calibration(), true));
}

}  // namespace keyframe_policy_test
}  // namespace fbvins
