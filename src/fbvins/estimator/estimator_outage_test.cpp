// SPDX-License-Identifier: Apache-2.0
// The whole estimator on simulated tracks and readings: starts, and what it does when images, a camera or readings stop.
#include "fbvins/estimator/estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "fbvins/core/angle.hpp"
#include "fbvins/types/protection.hpp"
#include "tests/support/estimated_flight.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace estimator_outage_test {

using test::EstimatedFlight;
using test::exact_noise;
using test::fly;
using test::FourCameras;
using test::Motion;
using test::SimulatedFlight;

TEST(Estimator, BridgesASecondWithoutImages) {
  SimulatedFlight flight(Motion(0.6, 0.3), 7);
  flight.images = [](int k) { return k < 80 || k >= 100; };
  const EstimatedFlight flown = fly(flight, 160);
  for (int k = 80; k <= 100; ++k)  // frame 100 is the first after the gap
    EXPECT_EQ(flown.odometry[k].health, (Health{HealthState::degraded, HealthReason::no_images})) << k;
  for (int k = 105; k < 160; ++k) {
    EXPECT_EQ(flown.odometry[k].health.state, HealthState::good) << k;
    EXPECT_LT(flown.position_error(k), 0.12) << k;
  }
  EXPECT_EQ(flown.odometry.back().reset_counter, 0u);
  EXPECT_GT(flown.odometry[99].pose_covariance(0, 0), flown.odometry[79].pose_covariance(0, 0)) << "blindness costs certainty";
}

TEST(Estimator, ARestartForgetsWhatWasEstimatedOfTheCalibration) {
  SimulatedFlight flight(Motion(0.6, 0.3), 8);
  flight.images = [](int k) { return k < 100; };
  EstimatorOptions options = exact_noise();
  options.estimate_extrinsics = true;
  options.max_blind_m = 0.1;
  Estimator estimator(flight.rig, options);
  const Calibration given = estimator.calibration();
  bool changed = false;
  for (int k = 0; k < 400 && estimator.process(flight.frame(k)).odometry.health.state != HealthState::lost; ++k)
    changed = changed || estimator.calibration().T_BC0().p != given.T_BC0().p;
  EXPECT_TRUE(changed);
  EXPECT_EQ(estimator.calibration().T_BC0().p, given.T_BC0().p);
}

TEST(Estimator, AStartAfterAClockWasSetBackHasToProveItself) {
  for (const bool clock_set_back : {false, true}) {
    SimulatedFlight flight(Motion(0.6, 0.3), 8);
    Estimator estimator(flight.rig, exact_noise());
    for (int k = 0; k < 80; ++k) (void)estimator.process(flight.frame(k));
    estimator.start_again(clock_set_back);
    std::vector<Health> with_pose;
    for (int k = 80; k < 160; ++k)
      if (const Health health = estimator.process(flight.frame(k)).odometry.health; health.has_pose())
        with_pose.push_back(health);
    ASSERT_GT(with_pose.size(), 30u);
    for (int k = 0; k < 19; ++k)  // a second of agreement
      EXPECT_EQ(with_pose[k].reason, clock_set_back ? HealthReason::contradiction : HealthReason::none) << k;
    EXPECT_EQ(with_pose[25].state, HealthState::good);
  }
}

TEST(Estimator, BridgesHalfASecondWithoutReadings) {
  SimulatedFlight flight(Motion(0.6, 0.3), 8);
  flight.readings = [](int k) { return k < 80 || k >= 90; };
  const EstimatedFlight flown = fly(flight, 160);
  for (int k = 80; k < 90; ++k) EXPECT_EQ(flown.odometry[k].health, (Health{HealthState::degraded, HealthReason::imu_gap})) << k;
  for (int k = 95; k < 160; ++k) {
    EXPECT_EQ(flown.odometry[k].health.state, HealthState::good) << k;
    EXPECT_LT(flown.position_error(k), 0.06) << k;
  }
  EXPECT_EQ(flown.odometry.back().reset_counter, 0u);
}

TEST(Estimator, FliesOnWithOneCamera) {
  SimulatedFlight flight(Motion(0.6, 0.3), 9);
  flight.right_camera = [](int k) { return k < 60 || k >= 120; };
  const EstimatedFlight flown = fly(flight, 180);
  const int first = flown.first_pose();
  EXPECT_EQ(flown.odometry[90].health, (Health{HealthState::degraded, HealthReason::one_camera, 0b10}));
  for (int k = first; k < 180; ++k) EXPECT_LT(flown.position_error(k), 0.08) << k;
}

TEST(Estimator, FliesOnWithTheRightCameraAlone) {
  SimulatedFlight flight(Motion(0.6, 0.3), 9);
  flight.left_camera = [](int k) { return k < 60 || k >= 160; };
  const EstimatedFlight flown = fly(flight, 220);
  EXPECT_EQ(flown.odometry[90].health, (Health{HealthState::degraded, HealthReason::one_camera, 0b01}));
  EXPECT_GT(flown.odometry[155].stats.landmarks, 40) << "new ones, too";
  for (int k = flown.first_pose(); k < 220; ++k) EXPECT_LT(flown.position_error(k), 0.08) << k;
  EXPECT_EQ(flown.odometry.back().health.state, HealthState::good);
}

TEST(Estimator, FliesOnWhereOneOfTwoPairsIsBlind) {
  for (const bool front : {true, false}) {
    FourCameras flight(Motion(0.6, 0.3), 9);
    (front ? flight.front : flight.back).images = [](int k) { return k < 60 || k >= 160; };
    const EstimatedFlight flown = fly(flight, 220);
    const std::uint8_t blind = front ? 0b0011 : 0b1100;
    EXPECT_EQ(flown.odometry[100].health, (Health{HealthState::degraded, HealthReason::one_camera, blind}));
    for (int k = flown.first_pose(); k < 220; ++k) {
      EXPECT_TRUE(flown.odometry[k].health.has_pose());
      EXPECT_LT(flown.position_error(k), 0.05) << k;
    }
    EXPECT_EQ(flown.odometry.back().health.state, HealthState::good);
  }
}

TEST(Estimator, APairFromNumberTwoOnStartsAlone) {
  FourCameras flight(Motion(0.6, 0.3), 9);
  flight.front.images = [](int) { return false; };
  const EstimatedFlight flown = fly(flight, 120);
  ASSERT_GE(flown.first_pose(), 0);
  for (int k = flown.first_pose(); k < 120; ++k) EXPECT_LT(flown.position_error(k), 0.06) << k;
}

TEST(Estimator, AStartNeedsBothCamerasAndSaysSo) {
  for (const bool left : {true, false}) {
    SimulatedFlight flight(Motion(0.6, 0.3), 14);
    flight.left_camera = [&](int k) { return left || k >= 30; };
    flight.right_camera = [&](int k) { return !left || k >= 30; };
    const EstimatedFlight flown = fly(flight, 60);
    const std::uint8_t missing = left ? 0b10 : 0b01;
    for (int k = 0; k < 30; ++k)
      EXPECT_EQ(flown.odometry[k].health, (Health{HealthState::initialising, HealthReason::one_camera, missing})) << k;
    EXPECT_EQ(flown.odometry.back().health.state, HealthState::good);
  }
}

/// In motion and at rest: images in which one camera is missing are passed over.
TEST(Estimator, AStartDoesNotNeedEveryImageOfBothCameras) {
  for (const Motion& motion : {Motion(0.6, 0.3), Motion(0, 0)}) {
    SimulatedFlight flight(motion, 14);
    flight.left_camera = [](int k) { return k % 7 != 3; };
    const EstimatedFlight flown = fly(flight, 60);
    EXPECT_LT(flown.first_pose(), 42) << "forty images, where pairs of camera 0 are too few";
    EXPECT_TRUE(flown.odometry.back().health.has_pose());
  }
}

TEST(Estimator, ARefusedStartIsNotPublished) {
  SimulatedFlight flight(Motion(0.6, 0.3), 1);
  EstimatorOptions options = exact_noise();
  options.max_speed_mps = 0.01;  // every start in motion is implausible
  Estimator estimator(flight.rig, options);
  int refused = 0;
  for (int k = 0; k < 40; ++k) {
    const Odometry o = estimator.process(flight.frame(k)).odometry;
    ASSERT_EQ(o.health.state, HealthState::initialising);
    refused += o.health.reason == HealthReason::alignment_refused && o.stats.iterations > 0;
    EXPECT_TRUE(estimator.snapshot().frames.empty()) << k;
    EXPECT_TRUE(o.pose_covariance.isZero(0)) << k;
  }
  EXPECT_GT(refused, 0);
}

TEST(Estimator, WaitsForImages) {
  SimulatedFlight flight(Motion(0.6, 0.3), 14);
  flight.images = [](int k) { return k >= 10; };
  const EstimatedFlight flown = fly(flight, 40);
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(flown.odometry[k].health, (Health{HealthState::initialising, HealthReason::no_images})) << k;
  EXPECT_EQ(flown.odometry.back().health.state, HealthState::good);
}

TEST(Estimator, TheFirstImageAfterAGapIsDegraded) {
  // Images 80 to 89 never come; the next brings all readings since 79.
  SimulatedFlight flight(Motion(0.6, 0.3), 15);
  Estimator estimator(flight.rig, exact_noise());
  ImuSegment since;
  for (int k = 0; k < 120; ++k) {
    TrackedFrame frame = flight.frame(k);
    if (k >= 80 && k <= 90) {
      const auto begin = frame.imu.samples.begin() + (since.samples.empty() ? 0 : 1);  // neighbours share a stamp
      since.samples.insert(since.samples.end(), begin, frame.imu.samples.end());
      since.longest_gap = frame.imu.longest_gap;
      if (k < 90) continue;
      frame.imu = since;
    }
    const Health health = estimator.process(frame).odometry.health;
    if (k == 90) {
      EXPECT_EQ(health, (Health{HealthState::degraded, HealthReason::no_images}));
    } else if (k > 40) {
      EXPECT_EQ(health, (Health{HealthState::good, HealthReason::none})) << k;
    }
  }
}

TEST(Estimator, BlindForTooLongIsLostAndStartsAgain) {
  SimulatedFlight flight(Motion(0.6, 0.3), 11);
  flight.images = [](int k) { return k < 60 || k >= 130; };
  EstimatorOptions options = exact_noise();
  options.max_blind_m = 0.03;
  const EstimatedFlight flown = fly(flight, 200, options);
  const auto is_lost = [](const Odometry& o) { return o.health.state == HealthState::lost; };
  const auto lost = std::find_if(flown.odometry.begin(), flown.odometry.end(), is_lost);
  ASSERT_NE(lost, flown.odometry.end());
  EXPECT_EQ(lost->health.reason, HealthReason::no_images);
  EXPECT_EQ(lost[1].health, (Health{HealthState::initialising, HealthReason::no_images}));
  EXPECT_EQ(flown.odometry.back().health.state, HealthState::good);
  EXPECT_EQ(flown.odometry.back().reset_counter, 1u);
}

TEST(Estimator, ARestartWithAWrongAccelerometerIsNotGood) {
  for (const double wrong_mps2 : {1.9, -1.7}) {
    SimulatedFlight flight(Motion(0.5, 0.1), 3);
    EstimatorOptions options = exact_noise();
    options.max_blind_m = 0.05;
    Estimator estimator(flight.rig, options);
    const Vec3 bias = flight.bias.accel_mps2;
    int resets = 0, poses = 0;
    for (int k = 0; k < 300; ++k) {
      flight.bias.accel_mps2 = bias + (k >= 120 && k < 240 ? Vec3(0, wrong_mps2, 0) : Vec3::Zero());
      flight.images = [](int i) { return i < 120 || i >= 160; };  // so long that the estimate is lost
      const Odometry out = estimator.process(flight.frame(k)).odometry;
      resets = static_cast<int>(out.reset_counter);
      if (k < 160 || !out.health.has_pose()) continue;
      ++poses;
      if (out.health.state != HealthState::good) continue;
      const Vec3 up = out.T_WB.q.conjugate() * Vec3::UnitZ(), truth = flight.truth(k).T_FB.q.conjugate() * Vec3::UnitZ();
      EXPECT_LT(std::acos(std::min(1.0, up.dot(truth))), 5 * kDegree) << k;
    }
    EXPECT_GE(resets, 1);
    EXPECT_GT(poses, 20);
  }
}

/// How long the IMU may carry the pose depends on the IMU, and what it says of its error is true.
TEST(Estimator, AGoodImuCarriesThePoseForLongerThanABadOne) {
  int carried[2] = {};
  for (const bool good : {true, false}) {
    SimulatedFlight flight(Motion(0.6, 0.3), 11);
    flight.images = [](int k) { return k < 100; };
    EstimatorOptions options = exact_noise();
    if (!good) options.accel_noise_scale = 100;
    const EstimatedFlight flown = fly(flight, 400, options);
    for (int k = 100; k < 400 && flown.odometry[k].health.has_pose(); ++k, ++carried[good]) {
      EXPECT_EQ(flown.odometry[k].health, (Health{HealthState::degraded, HealthReason::no_images})) << k;
      EXPECT_LT(flown.position_error(k), 0.02 + 3 * worst_sigma_m(flown.odometry[k].pose_covariance)) << k;
    }
  }
  EXPECT_GT(carried[true], 100) << "five seconds";
  EXPECT_LT(carried[false], 60) << "three";
}

}  // namespace estimator_outage_test
}  // namespace fbvins
