// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/run_errors.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_run.hpp"

namespace fbvins {
namespace run_errors_test {

StateNees mean_of(const RunErrors& errors) {
  StateNees mean;
  for (const FrameError& e : errors.frames) {
    mean.position += e.nees.position, mean.orientation += e.nees.orientation, mean.velocity += e.nees.velocity;
    mean.gyro_bias += e.nees.gyro_bias, mean.accel_bias += e.nees.accel_bias;
  }
  const double n = static_cast<double>(errors.frames.size());
  return {mean.position / n, mean.orientation / n, mean.velocity / n, mean.gyro_bias / n, mean.accel_bias / n};
}

TEST(RunErrors, AnExactEstimateInAnotherFrameHasNoErrors) {
  const RunErrors errors = run_errors(circling_run(0));
  ASSERT_EQ(errors.frames.size(), 200u);
  ASSERT_TRUE(errors.evaluation.has_value());
  EXPECT_LT(errors.evaluation->absolute_m.max, 1e-9);
  for (const FrameError& e : errors.frames) {
    EXPECT_LT(e.absolute_m, 1e-9);
    EXPECT_LT(e.drift_m.norm(), 1e-9);
    EXPECT_LT(e.velocity_error_mps.norm(), 1e-9);
  }
}

TEST(RunErrors, ConsistentNoiseHasANeesOfThree) {
  // 199 noisy frames with three degrees of freedom each: the mean's standard deviation is 0.17.
  const StateNees mean = mean_of(run_errors(circling_run(1)));
  for (double value : {mean.position, mean.orientation, mean.velocity, mean.gyro_bias, mean.accel_bias})
    EXPECT_NEAR(value, 3, 0.6);
}

TEST(RunErrors, TwiceTheErrorIsFourTimesTheNees) {
  const StateNees mean = mean_of(run_errors(circling_run(2)));
  for (double value : {mean.position, mean.orientation, mean.velocity, mean.gyro_bias, mean.accel_bias})
    EXPECT_NEAR(value, 12, 2.4);
}

TEST(RunErrors, FramesWithoutAPoseDoNotCount) {
  RunFolder run = circling_run(1);
  run.odometry[10].health = {HealthState::lost, HealthReason::no_tracks};
  run.odometry[10].T_WB.p = Vec3::Constant(1e6);
  const RunErrors errors = run_errors(run);
  EXPECT_EQ(errors.frames.size(), 199u);
  EXPECT_LT(errors.evaluation->absolute_m.max, 0.1);
}

TEST(RunErrors, TheFrameIsAlignedAgainAfterARestart) {
  RunFolder run = circling_run(0);
  const Pose<W, W> elsewhere(so3_exp(Vec3(0, 0, 1.1)), Vec3(5, 5, 5));
  for (std::size_t k = 100; k < 200; ++k) {
    run.odometry[k].T_WB = elsewhere * run.odometry[k].T_WB;
    run.odometry[k].v_WB = elsewhere.q * run.odometry[k].v_WB;
    run.odometry[k].reset_counter = 1;
  }
  const RunErrors errors = run_errors(run);
  for (const FrameError& e : errors.frames) EXPECT_LT(e.drift_m.norm() + e.velocity_error_mps.norm(), 1e-8);
}

TEST(TruthAt, IsLinearAndHasGaps) {
  const std::vector<TrajectoryPoint> truth = circling_run(0).truth;
  const auto between = truth_at(truth, truth[3].t + Duration{25'000'000});
  ASSERT_TRUE(between.has_value());
  EXPECT_LT((between->T_WB.p - 0.5 * (truth[3].T_WB.p + truth[4].T_WB.p)).norm(), 1e-12);
  EXPECT_FALSE(truth_at(truth, truth.front().t - Duration{1}).has_value());
  EXPECT_FALSE(truth_at(truth, truth.back().t + Duration{1}).has_value());
  EXPECT_FALSE(truth_at({truth[0], truth[10]}, truth[5].t).has_value());
}

}  // namespace run_errors_test
}  // namespace fbvins
