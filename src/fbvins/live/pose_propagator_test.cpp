// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/pose_propagator.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace pose_propagator_test {

constexpr double kPeriod_s = 0.005;

Time at(double s) { return Time{Duration::from_seconds(100 + s).ns}; }

/// A body that turns about its z axis and swings along x of W: every quantity in closed form.
struct Motion {
  double rate_radps = 0.8, amplitude_m = 0.5, frequency_radps = 2.5;
  NavState<W> state(double s) const {
    NavState<W> n;
    n.T_FB.q = so3_exp(Vec3(0, 0, rate_radps * s));
    n.T_FB.p = Vec3(amplitude_m * std::sin(frequency_radps * s), 0, 1);
    n.v_FB = Vec3(amplitude_m * frequency_radps * std::cos(frequency_radps * s), 0, 0);
    return n;
  }
  ImuSample reading(double s) const {
    const Vec3 a_W(-amplitude_m * frequency_radps * frequency_radps * std::sin(frequency_radps * s), 0, 0);
    return {at(s), Vec3(0, 0, rate_radps), state(s).T_FB.q.conjugate() * (a_W - level_gravity())};
  }
  Odometry estimate(double s) const {
    Odometry o;
    const NavState<W> n = state(s);
    o.t = at(s), o.T_WB = n.T_FB, o.v_WB = n.v_FB, o.health = {HealthState::good, HealthReason::none};
    o.pose_covariance = 1e-6 * Mat6::Identity();
    o.velocity_covariance = 1e-4 * Mat3::Identity();
    return o;
  }
};

TEST(PosePropagator, NoPoseBeforeTheFirstEstimate) {
  PosePropagator propagator({}, {}, 0.1);
  const LivePose pose = *propagator.add(Motion{}.reading(0));
  EXPECT_EQ(pose.health.state, HealthState::initialising);
  EXPECT_EQ(pose.t, at(0));
}

TEST(PosePropagator, FollowsTheTruthBetweenImages) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  double largest_m = 0, largest_rad = 0;
  for (int k = 0; k < 400; ++k) {
    const double s = k * kPeriod_s;
    const LivePose pose = *propagator.add(motion.reading(s));
    // The estimate of an image 50 ms ago, between two readings.
    if (k % 10 == 9 && k > 10) propagator.rebase(motion.estimate(s - 0.0513));
    if (!pose.health.has_pose()) continue;
    const NavState<W> truth = motion.state(s);
    largest_m = std::max(largest_m, (pose.T_WB.p - truth.T_FB.p).norm());
    largest_rad = std::max(largest_rad, so3_log(pose.T_WB.q.conjugate() * truth.T_FB.q).norm());
    EXPECT_LT((pose.v_WB - truth.v_FB).norm(), 1e-3);
    EXPECT_NEAR(pose.w_WB_B.z(), motion.rate_radps, 1e-12);
  }
  EXPECT_LT(largest_m, 2e-5);
  EXPECT_LT(largest_rad, 1e-9);
}

TEST(PosePropagator, GravityHasTheEstimatesDirectionWhileATiltIsBeingCorrected) {
  const Motion motion;
  const Quat tilt = so3_exp(Vec3(0.03, -0.02, 0));
  PosePropagator propagator({}, {}, 0.1);
  Odometry estimate = motion.estimate(0);
  estimate.T_WB = {(tilt * estimate.T_WB.q).normalized(), Vec3(tilt * estimate.T_WB.p)};
  estimate.v_WB = tilt * estimate.v_WB;
  estimate.up_W = tilt * Vec3::UnitZ();
  estimate.tilt_sigma_rad = 0.02;
  LivePose pose;
  for (int k = 0; k < 40; ++k) {
    pose = *propagator.add(motion.reading(k * kPeriod_s));
    if (k == 1) propagator.rebase(estimate);
  }
  const NavState<W> truth = motion.state(39 * kPeriod_s);
  EXPECT_LT((pose.T_WB.p - tilt * truth.T_FB.p).norm(), 1e-4);
  EXPECT_LT((pose.v_WB - tilt * truth.v_FB).norm(), 1e-3);
  EXPECT_EQ(pose.tilt_sigma_rad, 0.02);
  EXPECT_FALSE(pose.level);
}

TEST(PosePropagator, BiasesAreTakenOffTheReadings) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  const ImuBias bias{Vec3(0.02, -0.01, 0.03), Vec3(0.1, 0.2, -0.1)};
  LivePose pose;
  for (int k = 0; k < 40; ++k) {
    ImuSample reading = motion.reading(k * kPeriod_s);
    reading.gyro_radps += bias.gyro_radps;
    reading.accel_mps2 += bias.accel_mps2;
    pose = *propagator.add(reading);
    Odometry estimate = motion.estimate(0);
    estimate.bias = bias;
    if (k == 1) propagator.rebase(estimate);
  }
  EXPECT_LT((pose.T_WB.p - motion.state(39 * kPeriod_s).T_FB.p).norm(), 1e-4);
}

TEST(PosePropagator, PosesAreOnTheClockOfTheImages) {
  const Motion motion;
  const Duration offset = Duration::from_seconds(0.012);
  PosePropagator propagator({}, offset, 0.1);
  LivePose pose;
  for (int k = 0; k < 40; ++k) {
    pose = *propagator.add(motion.reading(k * kPeriod_s));
    Odometry estimate = motion.estimate(0.05);
    estimate.t = estimate.t - offset;
    if (k == 20) propagator.rebase(estimate);
  }
  EXPECT_LT((pose.T_WB.p - motion.state(39 * kPeriod_s).T_FB.p).norm(), 1e-4);
  EXPECT_EQ(pose.t, at(39 * kPeriod_s) - offset);
}

/// No finite pose follows from such readings, and one of them would stay in the pose for ever.
TEST(PosePropagator, ReadingsThatTheSensorCannotHaveMadeDoNothing) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  propagator.add(motion.reading(0));
  propagator.rebase(motion.estimate(0));
  double largest_m = 0;
  for (int k = 1; k < 100; ++k) {
    ImuSample reading = motion.reading(k * kPeriod_s);
    if (k == 20) reading.accel_mps2.x() = 1e6;
    if (k == 30) reading.accel_mps2.x() = 3e38;
    if (k == 40) reading.gyro_radps.x() = 1e200;
    const std::optional<LivePose> pose = propagator.add(reading);
    ASSERT_EQ(pose.has_value(), k != 20 && k != 30 && k != 40);
    if (pose) largest_m = std::max(largest_m, (pose->T_WB.p - motion.state(k * kPeriod_s).T_FB.p).norm());
  }
  EXPECT_LT(largest_m, 2e-3);
}

/// A jump of the estimate moves the output by no more than a share of it per reading.
TEST(PosePropagator, ConvergesToANewEstimateWithoutAStep) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  const Vec3 shift(0.05, -0.02, 0.01);
  double largest_step_m = 0;
  LivePose pose;
  Vec3 error_before = Vec3::Zero();
  for (int k = 0; k < 300; ++k) {
    const double s = k * kPeriod_s;
    pose = *propagator.add(motion.reading(s));
    Odometry estimate = motion.estimate(s);
    if (k >= 100) estimate.T_WB.p += shift;
    if (k % 10 == 0) propagator.rebase(estimate);
    const Vec3 error = pose.T_WB.p - motion.state(s).T_FB.p;
    if (k > 1) largest_step_m = std::max(largest_step_m, (error - error_before).norm());
    error_before = error;
  }
  EXPECT_LT(largest_step_m, shift.norm() * kPeriod_s / 0.1);
  EXPECT_LT((error_before - shift).norm(), 1e-4);
}

/// The interval up to such an estimate is in it already.
TEST(PosePropagator, EstimatesNewerThanEveryReadingAreNotPropagatedTwice) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  LivePose pose;
  for (int k = 0; k < 200; ++k) {
    const double s = k * kPeriod_s;
    const bool gap = k > 100 && k < 120;
    if (!gap) pose = *propagator.add(motion.reading(s));
    if (k == 10 || k == 110 || k == 118) propagator.rebase(motion.estimate(s));
    if (k < 11 || gap) continue;
    EXPECT_LT((pose.T_WB.p - motion.state(s).T_FB.p).norm(), 2e-3) << k;
    EXPECT_LT(so3_log(pose.T_WB.q.conjugate() * motion.state(s).T_FB.q).norm(), 1e-9) << k;
  }
}

/// The first reading comes after the first estimate.
TEST(PosePropagator, AnEstimateBeforeAllReadings) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0);
  propagator.rebase(motion.estimate(0));
  const LivePose pose = *propagator.add(motion.reading(kPeriod_s));
  EXPECT_LT((pose.T_WB.p - motion.state(kPeriod_s).T_FB.p).norm(), 1e-4);
}

TEST(PosePropagator, WithoutSmoothingANewEstimateCountsAtOnce) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0);
  propagator.add(motion.reading(0));
  propagator.rebase(motion.estimate(0));
  propagator.add(motion.reading(kPeriod_s));
  Odometry moved = motion.estimate(kPeriod_s);
  moved.T_WB.p.x() += 0.3;
  propagator.rebase(moved);
  const LivePose pose = *propagator.add(motion.reading(2 * kPeriod_s));
  EXPECT_NEAR(pose.T_WB.p.x(), motion.state(2 * kPeriod_s).T_FB.p.x() + 0.3, 1e-5);
}

TEST(PosePropagator, ARestartCountsAtOnceAndIsCounted) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  propagator.add(motion.reading(0));
  propagator.rebase(motion.estimate(0));
  propagator.add(motion.reading(kPeriod_s));
  Odometry restarted = motion.estimate(kPeriod_s);
  restarted.T_WB.p.x() += 5;
  restarted.reset_counter = 1;
  propagator.rebase(restarted);
  const LivePose pose = *propagator.add(motion.reading(2 * kPeriod_s));
  EXPECT_EQ(pose.reset_counter, 1u);
  EXPECT_NEAR(pose.T_WB.p.x(), motion.state(2 * kPeriod_s).T_FB.p.x() + 5, 1e-5);
}

TEST(PosePropagator, LostMeansNoPose) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  propagator.add(motion.reading(0));
  propagator.rebase(motion.estimate(0));
  Odometry lost = motion.estimate(0);
  lost.health = {HealthState::lost, HealthReason::no_tracks};
  propagator.rebase(lost);
  const LivePose pose = *propagator.add(motion.reading(kPeriod_s));
  EXPECT_FALSE(pose.health.has_pose());
  EXPECT_TRUE(pose.T_WB.p.isZero());
}

/// Images at 20 Hz go on where the IMU is silent, and so does the pose.
TEST(PosePropagator, WhileTheImuIsSilentThePoseIsThatOfTheImages) {
  const Motion motion;
  PosePropagator propagator({}, {}, 0.1);
  for (int k = 0; k <= 100; ++k) {
    propagator.add(motion.reading(k * kPeriod_s));
    if (k % 10 == 0) {
      EXPECT_FALSE(propagator.rebase(motion.estimate(k * kPeriod_s)));
    }
  }
  for (double s = 0.55; s < 2; s += 0.05) {
    const Odometry estimate = motion.estimate(s);
    const std::optional<LivePose> pose = propagator.rebase(estimate);
    ASSERT_TRUE(pose);
    EXPECT_EQ(pose->t, estimate.t);
    EXPECT_EQ(pose->estimate_t, estimate.t);
    EXPECT_EQ(pose->health, estimate.health);
    EXPECT_EQ(pose->T_WB.p, estimate.T_WB.p);
    EXPECT_EQ(pose->w_WB_B, Vec3::Zero());
    EXPECT_TRUE(pose->pose_covariance.isApprox(estimate.pose_covariance, 1e-9));
  }
  const LivePose again = *propagator.add(motion.reading(2));
  EXPECT_LT((again.T_WB.p - motion.state(2).T_FB.p).norm(), 0.02);
}

TEST(PosePropagator, TheCovarianceHasTheNoiseAndTheGaps) {
  const Motion motion;
  const auto sigma_m = [&](const ImuNoise& noise, int gap_readings) {
    PosePropagator propagator(noise, {}, 0.1);
    LivePose pose;
    for (int k = 0; k <= 100; ++k) {
      if (k > 40 && k <= 40 + gap_readings) continue;
      pose = *propagator.add(motion.reading(k * kPeriod_s));
      if (k == 0) propagator.rebase(motion.estimate(0));
    }
    return std::sqrt(pose.pose_covariance(0, 0));
  };
  ImuNoise noise, larger = noise;
  larger.accel_noise_density_mps2_rthz *= 100;
  EXPECT_GT(sigma_m(larger, 0), 2 * sigma_m(noise, 0));
  EXPECT_GT(sigma_m(noise, 30), 5 * sigma_m(noise, 0));
}

/// The propagated covariance agrees with numeric derivatives of the propagated state.
TEST(PosePropagator, CovarianceIsThatOfTheErrors) {
  const Motion motion;
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = noise.accel_noise_density_mps2_rthz = 0;
  noise.gyro_random_walk_radps2_rthz = noise.accel_random_walk_mps3_rthz = 0;
  constexpr int kSteps = 60;
  const Vec15 sigma =
      (Vec15() << Vec3::Constant(2e-3), Vec3::Constant(3e-3), Vec3::Constant(2e-2), Vec3::Constant(2e-3), Vec3::Constant(3e-2))
          .finished();

  const auto fly = [&](const Vec15& error) {
    PosePropagator propagator(noise, {}, 0);
    Odometry o = motion.estimate(0);
    const NavState<W> start = motion.state(0).boxplus(error);
    o.T_WB = start.T_FB, o.v_WB = start.v_FB, o.bias = start.bias;
    const Vec15 variance = sigma.cwiseProduct(sigma);
    o.pose_covariance = variance.head<6>().asDiagonal();
    o.velocity_covariance = variance.segment<3>(nav::v).asDiagonal();
    o.gyro_bias_covariance = variance.segment<3>(nav::bg).asDiagonal();
    o.accel_bias_covariance = variance.segment<3>(nav::ba).asDiagonal();
    propagator.add(motion.reading(0));
    propagator.rebase(o);
    LivePose pose;
    for (int k = 1; k <= kSteps; ++k) pose = *propagator.add(motion.reading(k * kPeriod_s));
    return pose;
  };
  const LivePose middle = fly(Vec15::Zero());
  Eigen::Matrix<double, 9, 15> spread;
  for (int i = 0; i < 15; ++i) {
    const LivePose pose = fly(Vec15::Unit(i) * sigma(i) * 1e-2);
    spread.col(i) << pose.T_WB.p - middle.T_WB.p, so3_log(middle.T_WB.q.conjugate() * pose.T_WB.q), pose.v_WB - middle.v_WB;
  }
  const Eigen::Matrix<double, 9, 9> expected = 1e4 * spread * spread.transpose();
  const Mat6 pose_expected = expected.topLeftCorner<6, 6>();
  const Mat3 velocity_expected = expected.bottomRightCorner<3, 3>();
  EXPECT_LT((middle.pose_covariance - pose_expected).norm(), 0.02 * pose_expected.norm());
  EXPECT_LT((middle.velocity_covariance - velocity_expected).norm(), 0.02 * velocity_expected.norm());
}

}  // namespace pose_propagator_test
}  // namespace fbvins
