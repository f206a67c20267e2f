// SPDX-License-Identifier: Apache-2.0
// Published poses never jump, and become level: the whole estimator on simulated tracks and readings.
#include <gtest/gtest.h>

#include "fbvins/estimator/estimator.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace step_contract_test {

using test::Motion;
using test::SimulatedFlight;

double angle(const Quat& a, const Quat& b) { return so3_log((a.conjugate() * b).normalized()).norm(); }

double tilt_error(const Quat& a, const Quat& b) {
  const Vec3 up_a = a.conjugate() * Vec3::UnitZ(), up_b = b.conjugate() * Vec3::UnitZ();
  return std::atan2(up_a.cross(up_b).norm(), up_a.dot(up_b));
}

struct LargestStep {
  double m = 0, rad = 0;  ///< of the published pose, in addition to the motion by the readings
  double untrue_m = 0;    ///< of the published pose, other than the true motion
  double gauge_m = 0;     ///< of the window's own estimate
  double pending_m = 0;   ///< between the published and the estimated position
  int poses = 0, restarts = 0;
};

/// Flies and compares each published pose with the one before, propagated by the readings.
LargestStep fly(SimulatedFlight& flight, int frames, const EstimatorOptions& options) {
  Estimator estimator(flight.rig, options);
  LargestStep out;
  std::optional<Odometry> before;
  for (int k = 0; k < frames; ++k) {
    const Odometry o = estimator.process(flight.frame(k)).odometry;
    const FrameList& window = estimator.window().frames();
    if (before && before->reset_counter == o.reset_counter && o.health.has_pose()) {
      const NavState<G>& from = window[window.size() - 2].state;
      const Vec3 gravity_G = estimator.window().tilt().gravity_G(options.gravity_mps2);
      const Frame& newest = window.newest();
      const NavState<G> to = newest.imu ? newest.imu->predict(from, gravity_G) : newest.state;
      const Pose<W, B> moved = before->T_WB * (from.T_FB.inverse() * to.T_FB);
      out.m = std::max(out.m, (o.T_WB.p - moved.p).norm());
      out.rad = std::max(out.rad, angle(moved.q, o.T_WB.q));
      const Pose<B, B> seen = before->T_WB.inverse() * o.T_WB;
      const Pose<B, B> true_motion = flight.truth(k - 1).T_FB.inverse() * flight.truth(k).T_FB;
      out.untrue_m = std::max(out.untrue_m, (seen.p - true_motion.p).norm());
      out.gauge_m = std::max(out.gauge_m, (from.T_FB.p - before->gauge.T_GB.p).norm());
      out.pending_m = std::max(out.pending_m, (estimator.window().tilt().levelled(newest.state.T_FB).p - o.T_WB.p).norm());
      ++out.poses;
    }
    out.restarts = static_cast<int>(o.reset_counter);
    before.reset();
    if (o.health.has_pose()) before = o;
  }
  return out;
}

/// `most_untrue_m`: from one image to the next, against the true motion.
void expect_within(const LargestStep& step, const EstimatorOptions& options, double most_untrue_m = 0.003) {
  EXPECT_LT(step.untrue_m, most_untrue_m);
  EXPECT_LE(step.m, options.max_step_m + 1e-12);
  EXPECT_LE(step.rad, kRotationPerStep_radpm * options.max_step_m + 1e-9);
}

TEST(StepContract, HoldsWhileWIsLevelled) {
  SimulatedFlight flight(Motion(0.6, 0.5), 31);
  flight.bias.accel_mps2 = Vec3(0.3, -0.3, 0.1);  // two and a half degrees
  const LargestStep step = fly(flight, 200, EstimatorOptions{});
  expect_within(step, EstimatorOptions{});
  EXPECT_GT(step.pending_m, 1e-3) << "there was something to correct";
  EXPECT_GT(step.poses, 150);
}

TEST(StepContract, HoldsWhenTheWindowJumpsAfterAGap) {
  SimulatedFlight flight(Motion(0.6, 0.5), 32);
  flight.reobserves = true;
  flight.images = [](int k) { return k < 80 || k >= 110; };
  const LargestStep step = fly(flight, 200, EstimatorOptions{});
  expect_within(step, EstimatorOptions{});
  EXPECT_GT(step.gauge_m, EstimatorOptions{}.max_step_m) << "the window did jump";
  EXPECT_EQ(step.restarts, 0);
}

TEST(StepContract, HoldsAfterARestartAsWell) {
  SimulatedFlight flight(Motion(0.6, 0.5), 33);
  flight.images = [](int k) { return k < 60 || k >= 220; };  // longer than the readings carry the pose
  const LargestStep step = fly(flight, 350, EstimatorOptions{});
  expect_within(step, EstimatorOptions{}, 0.005);  // a new start does not know its velocity as well
  EXPECT_EQ(step.restarts, 1);
  EXPECT_GT(step.poses, 120);
}

TEST(StepContract, WithoutALimitNothingIsPending) {
  SimulatedFlight flight(Motion(0.6, 0.5), 31);
  flight.bias.accel_mps2 = Vec3(0.3, -0.3, 0.1);
  EstimatorOptions options;
  options.max_step_m = 0;
  EXPECT_EQ(fly(flight, 100, options).pending_m, 0);
}

TEST(Level, IsReportedWhenTheTiltIsKnown) {
  SimulatedFlight flight(Motion(0.6, 0.5), 34);
  flight.bias.accel_mps2 = Vec3(0.3, -0.3, 0.1);
  EstimatorOptions exact;  // the simulated IMU has the calibrated noise
  exact.gyro_unmodelled_radps_rthz = exact.accel_unmodelled_mps2_rthz = 0;
  exact.gyro_walk_scale = exact.accel_walk_scale = 1;
  Estimator estimator(flight.rig, exact);
  bool was_level = false;
  int unknown = 0;
  for (int k = 0; k < 400; ++k) {
    const Odometry o = estimator.process(flight.frame(k)).odometry;
    if (!o.health.has_pose()) continue;
    const double error = tilt_error(o.T_WB.q, flight.truth(k).T_FB.q);
    EXPECT_LT(error, 4 * o.tilt_sigma_rad) << k;
    EXPECT_EQ(o.level, o.tilt_sigma_rad < kLevelSigma_rad) << k;
    EXPECT_TRUE(!o.level || error < 0.015) << k << ": " << error;
    if (!o.level) ++unknown;
    was_level = was_level || o.level;
  }
  EXPECT_TRUE(was_level);
  EXPECT_GT(unknown, 5) << "not before";
}

TEST(ImuState, BiasesOfTheFlightBeforeMakeTheStartLevel) {
  SimulatedFlight flight(Motion(0.6, 0.5), 35), again(Motion(0.6, 0.5), 35);
  flight.bias.accel_mps2 = again.bias.accel_mps2 = Vec3(0.3, -0.3, 0.1);
  ImuState before;
  before.biases = {flight.bias, 1e-8 * Mat3::Identity(), 1e-4 * Mat3::Identity()};
  before.biases.bias.accel_mps2 += Vec3(0.01, 0.01, -0.01);
  Estimator without(flight.rig, EstimatorOptions{}), with(flight.rig, EstimatorOptions{}, before);
  for (int k = 0; k < 40; ++k) {
    const Odometry unknown = without.process(flight.frame(k)).odometry, known = with.process(again.frame(k)).odometry;
    if (!unknown.health.has_pose() || !known.health.has_pose()) continue;
    EXPECT_LT(known.tilt_sigma_rad, unknown.tilt_sigma_rad) << k;
    EXPECT_LT(tilt_error(known.T_WB.q, flight.truth(k).T_FB.q), 0.008) << k;
  }
}

}  // namespace step_contract_test
}  // namespace fbvins
