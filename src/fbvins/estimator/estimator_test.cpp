// SPDX-License-Identifier: Apache-2.0
// The whole estimator on simulated tracks and readings: accuracy, gauge, keyframes.
#include "fbvins/estimator/estimator.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/geometry/heading.hpp"
#include "tests/support/estimated_flight.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace estimator_test {

using test::EstimatedFlight;
using test::exact_noise;
using test::fly;
using test::Motion;
using test::SimulatedFlight;

TEST(Estimator, FollowsAMotionThatNeverRests) {
  SimulatedFlight flight(Motion(0.6, 0.3), 1);
  const EstimatedFlight flown = fly(flight, 200);
  const int first = flown.first_pose();
  ASSERT_GE(first, 0);
  EXPECT_LT(first, 28) << "the time offset is looked for first";
  for (int k = first; k < 200; ++k) {
    EXPECT_EQ(flown.odometry[k].health, (Health{HealthState::good, HealthReason::none})) << k;
    EXPECT_LT(flown.position_error(k), 0.04) << k;
  }
  const Odometry& last = flown.odometry.back();
  EXPECT_LT((last.bias.gyro_radps - flight.bias.gyro_radps).norm(), 2e-3);
  EXPECT_LT((last.bias.accel_mps2 - flight.bias.accel_mps2).norm(), 0.05);
  EXPECT_LT((last.v_WB - flown.truth_in_W(199).v_FB).norm(), 0.05);
}

TEST(Estimator, TiltIsAbsolute) {
  SimulatedFlight flight(Motion(0.6, 0.3), 2);
  const EstimatedFlight flown = fly(flight, 120);
  const Vec3 up_estimated = flown.odometry.back().T_WB.q.conjugate() * Vec3::UnitZ();
  const Vec3 up_true = flown.truth.back().T_FB.q.conjugate() * Vec3::UnitZ();
  EXPECT_LT((up_estimated - up_true).norm(), 0.006);
}

TEST(Estimator, SameInputSameBits) {
  SimulatedFlight a(Motion(0.6, 0.3), 3), b(Motion(0.6, 0.3), 3);
  const EstimatedFlight one = fly(a, 100), two = fly(b, 100);
  for (int k = 0; k < 100; ++k) {
    EXPECT_EQ(one.odometry[k].T_WB.p, two.odometry[k].T_WB.p);
    EXPECT_EQ(one.odometry[k].pose_covariance, two.odometry[k].pose_covariance);
  }
}

TEST(Estimator, MistakenLandmarksDoNoHarm) {
  // From the sixth second on, tracks come back as those of points elsewhere: one in ten.
  SimulatedFlight flight(Motion(0.8, 0.8), 210);
  flight.reobserves = true;
  flight.mistaken = [](int k, int point) { return k > 120 && point % 10 == 3; };
  const EstimatedFlight flown = fly(flight, 400);
  for (int k = flown.first_pose(); k < 400; ++k) {
    EXPECT_NE(flown.odometry[k].health.reason, HealthReason::solver_failed) << k;
    EXPECT_LT(flown.position_error(k), 0.06) << k;
  }
  EXPECT_EQ(flown.odometry.back().reset_counter, 0u);
}

TEST(Estimator, PriorHasNoInformationOnPositionAndHeadingBeyondTheGauge) {
  for (const KeyframeLeaving policy : {KeyframeLeaving::oldest, KeyframeLeaving::entropy}) {
    SimulatedFlight flight(Motion(0.6, 0.3), 5);
    EstimatorOptions options = exact_noise();
    options.keyframes.leaving = policy;
    options.known_landmarks.enabled = false;  // they have information on position and heading
    Estimator estimator(flight.rig, options);
    for (int k = 0; k < 120; ++k) (void)estimator.process(flight.frame(k));
    const WindowPrior& prior = estimator.window().prior();
    ASSERT_FALSE(prior.empty());
    // The four unobservable directions of W9 (position and heading), at the first estimates and the estimated up.
    const Vec3 up_G = estimator.window().tilt().q() * Vec3::UnitZ();
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(prior.quadratic.size(), 4);
    for (std::size_t i = 0; i < prior.frames.size(); ++i) {
      const NavState<G>& s = estimator.window().frames()[prior.frames[i]].first_estimate;
      const int row = prior.frames_row() + 15 * static_cast<int>(i);
      N.block<3, 3>(row, 0).setIdentity();
      N.block<3, 1>(row, 3) = up_G.cross(s.T_FB.p);
      N.block<3, 1>(row + 3, 3) = s.T_FB.q.conjugate() * up_G;
      N.block<3, 1>(row + 6, 3) = up_G.cross(s.v_FB);
    }
    const Eigen::MatrixXd information = N.transpose() * prior.quadratic.H * N;
    // The start chose position and heading with 1 mm and 1 mrad: 1e6 each. Nothing may be added, and only what
    // linearisation rounds off may be lost. The tilt has no first estimate: that adds 2 % to what is known of the heading.
    for (int d = 0; d < 4; ++d) {
      EXPECT_LT(information(d, d), (d < 3 ? 1.001e6 : 1.03e6) * (1 + N.block<3, 1>(prior.frames_row(), d).squaredNorm()))
          << static_cast<int>(policy) << d;
    }
    const double smallest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(prior.quadratic.H).eigenvalues()(0);
    EXPECT_GT(smallest, -1e-6 * prior.quadratic.H.diagonal().maxCoeff()) << static_cast<int>(policy);
  }
}

TEST(Estimator, StartsFromRestAndStaysThere) {
  SimulatedFlight flight(Motion(0, 0), 6);
  flight.pixel_sigma_px = 0.2;
  const EstimatedFlight flown = fly(flight, 200);
  const int first = flown.first_pose();
  ASSERT_GE(first, 0);
  EXPECT_LT(first, 20);
  for (int k = first; k < 200; ++k) EXPECT_LT(flown.position_error(k), 0.005) << k;
  EXPECT_TRUE(flown.odometry.back().stats.standstill);
  EXPECT_LT((flown.odometry.back().bias.gyro_radps - flight.bias.gyro_radps).norm(), 1e-3);
}

TEST(Estimator, AFailedSolveKeepsTheLastCovarianceAndEnlargesIt) {
  SimulatedFlight flight(Motion(0.6, 0.3), 7);
  Estimator estimator(flight.rig, exact_noise());
  Odometry before, failed;
  for (int k = 0; k <= 80; ++k) {
    TrackedFrame frame = flight.frame(k);
    if (k == 80) frame.features[0].by(0)->normalised.x() = 1e300;  // its square is infinite
    before = std::exchange(failed, estimator.process(frame).odometry);
  }
  ASSERT_EQ(before.health.state, HealthState::good);
  ASSERT_EQ(failed.health, (Health{HealthState::degraded, HealthReason::solver_failed}));
  EXPECT_GT(before.pose_covariance(0, 0), 0);
  for (int i = 0; i < 3; ++i) EXPECT_GT(failed.pose_covariance(i, i), before.pose_covariance(i, i));
  EXPECT_EQ(failed.velocity_covariance, before.velocity_covariance);
}

TEST(Estimator, UpIsAStateWhetherLandmarksAreRememberedOrNot) {
  for (const bool known : {true, false}) {
    SimulatedFlight flight(Motion(0.6, 0.3), 16);
    EstimatorOptions options = exact_noise();
    options.known_landmarks.enabled = known;
    Estimator estimator(flight.rig, options);
    std::size_t located = 0;
    for (int k = 0; k < 120; ++k) {
      const Estimate estimate = estimator.process(flight.frame(k));
      located += estimate.landmarks.landmarks.size();
      if (k > 40) {
        EXPECT_EQ(estimate.odometry.health.state, HealthState::good) << k;
      }
    }
    EXPECT_TRUE(estimator.window().prior().with_tilt);
    EXPECT_FALSE(estimator.window().tilt().angle_rad.isZero(0));
    EXPECT_EQ(located > 0, known);
  }
}

TEST(Estimator, IsRobustToOutliers) {
  SimulatedFlight flight(Motion(0.6, 0.3), 10);
  flight.outlier = [](int k, std::int64_t track) {  // a tenth of the tracks jumps about, each in its own way
    return track % 10 == 0 ? Vec2(20 * std::sin(0.7 * k + static_cast<double>(track)), 15 * std::cos(1.1 * k)) : Vec2(0, 0);
  };
  const EstimatedFlight flown = fly(flight, 160);
  const int first = flown.first_pose();
  ASSERT_GE(first, 0);
  for (int k = first; k < 160; ++k) EXPECT_LT(flown.position_error(k), 0.05) << k;
}

TEST(Estimator, WindowIsBounded) {
  SimulatedFlight flight(Motion(0.6, 0.3), 12);
  const EstimatorOptions options = exact_noise();
  Estimator estimator(flight.rig, options);
  for (int k = 0; k < 200; ++k) {
    (void)estimator.process(flight.frame(k));
    EXPECT_LE(estimator.window().frames().size(), options.keyframes.max_keyframes + options.keyframes.newest_frames);
    EXPECT_LT(estimator.window().landmarks().all().size(), 1500u);
  }
}

TEST(Estimator, HandsOnKeyframesInOrderWithTheirLandmarks) {
  SimulatedFlight flight(Motion(0.6, 0.3), 13);
  Estimator estimator(flight.rig, exact_noise());
  FrameId last;
  int keyframes = 0;
  for (int k = 0; k < 120; ++k) {
    for (const Keyframe& keyframe : estimator.process(flight.frame(k)).keyframes) {
      EXPECT_GT(keyframe.id, last);
      last = keyframe.id;
      ++keyframes;
      ASSERT_GT(keyframe.landmarks.size(), 20u);
      const NavState<W> truth = flight.truth(static_cast<int>(keyframe.id.value));
      int near = 0;
      for (const KeyframeLandmark& l : keyframe.landmarks) {
        const Vec3 p_true = truth.T_FB * l.p_B;
        near +=
            std::any_of(flight.points().begin(), flight.points().end(), [&](const Vec3& p) { return (p - p_true).norm() < 0.1; });
      }
      EXPECT_GT(near, static_cast<int>(keyframe.landmarks.size()) / 2);
    }
  }
  EXPECT_GT(keyframes, 10);
}

TEST(Estimator, LearningTheTiltDoesNotMoveTheFirstPose) {
  SimulatedFlight flight(Motion(0.6, 0.3), 14);
  flight.bias.accel_mps2 = Vec3(0.3, 0.25, -0.3);  // taken for a tilt at the start
  Estimator estimator(flight.rig, exact_noise());
  std::optional<Odometry> first;
  for (int k = 0; k < 120; ++k) {
    const Odometry now = estimator.process(flight.frame(k)).odometry;
    if (!first && now.health.has_pose()) first = now;
  }
  ASSERT_TRUE(first);
  const Pose<W, B> levelled = estimator.window().tilt().levelled(first->gauge.T_GB);
  EXPECT_GT(levelled.q.angularDistance(first->T_WB.q), 0.015);
  EXPECT_LT((levelled.p - first->T_WB.p).norm(), 1e-3);
}

TEST(Estimator, TheGaugeIsTheWindowsOwnFrameWithUpBeside) {
  SimulatedFlight flight(Motion(0.6, 0.3), 13);
  Estimator estimator(flight.rig, exact_noise());
  int poses = 0;
  for (int k = 0; k < 60; ++k) {
    const Estimate estimate = estimator.process(flight.frame(k));
    for (const Keyframe& keyframe : estimate.keyframes) {
      EXPECT_LT((keyframe.gauge.q_LG * keyframe.gauge.T_GB.q).angularDistance(keyframe.T_WB.q), 1e-9);
      EXPECT_GT(keyframe.gauge.up_sigma_rad, 0);
    }
    const Odometry& o = estimate.odometry;
    if (!o.health.has_pose()) continue;
    ++poses;
    const StatePrior prior = estimator.prior();  // the frontend's is in G as well
    EXPECT_EQ(o.gauge.T_GB.p, prior.T_GB.p);
    EXPECT_EQ(o.gauge.v_GB, prior.v_GB);
    EXPECT_LT((o.gauge.up_G() + prior.gravity_G.normalized()).norm(), 1e-12);
    EXPECT_GT(o.gauge.up_sigma_rad, 1e-4);
    EXPECT_LT(o.gauge.up_sigma_rad, 0.1);
  }
  EXPECT_GT(poses, 30);
}

/// A correction that is larger than estimator.max_pending_m: degraded; twice as large: a new W.
TEST(Estimator, ACorrectionWithoutTroubleIsMadeInStepsAndThePoseIsNotGoodMeanwhile) {
  struct Told {
    int owed = 0, resets = 0;
  };
  const auto told_with = [](double max_pending_m) {
    EstimatorOptions options;
    options.max_pending_m = max_pending_m;
    SimulatedFlight flight(Motion(1.5, 0.3), 9);
    Told told;
    for (const Odometry& o : fly(flight, 200, options).odometry) {
      told.owed += o.health == Health{HealthState::degraded, HealthReason::correction_pending};
      told.resets = static_cast<int>(o.reset_counter);
    }
    return told;
  };
  EXPECT_EQ(told_with(0.1).owed, 0);
  const Told steps = told_with(0.01), at_once = told_with(0.003);
  EXPECT_GT(steps.owed, 0);
  EXPECT_EQ(steps.resets, 0);
  EXPECT_GT(at_once.resets, 0);
}

}  // namespace estimator_test
}  // namespace fbvins
