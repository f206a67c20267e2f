// SPDX-License-Identifier: Apache-2.0
// Poses at IMU rate over flights.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "fbvins/estimator/estimator.hpp"
#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/live/live_options.hpp"
#include "fbvins/live/pose_propagator.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace pose_statistics_test {

using test::Motion;
using test::SimulatedFlight;

/// Against exact truth, poses at IMU rate are about as accurate as the estimates of the images.
TEST(LivePose, ErrorAtImuRateIsHardlyMoreThanAtImages) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Motion motion(0.5, 0.3);
    SimulatedFlight flight(motion, seed);
    Estimator estimator(flight.rig, {});
    PosePropagator propagator(assumed_noise(flight.rig.imu_noise, EstimatorOptions{}), {}, LiveOptions{}.smoothing_s);
    // Both compared after the same first-pose alignment of position and heading: W begins at the body.
    std::optional<Pose<W, W>> T_truth_W;
    double at_images = 0, at_readings = 0;
    int images = 0, readings = 0;
    const auto error2 = [&](const Pose<W, B>& estimate, Time t) {
      const NavState<W> truth = motion.state(t.seconds());
      return (*T_truth_W * estimate.p - truth.T_FB.p).squaredNorm();
    };
    for (int k = 0; k < 400; ++k) {
      const TrackedFrame frame = flight.frame(k);
      std::optional<Odometry> estimate;
      for (std::size_t i = 1; i < frame.imu.samples.size(); ++i) {
        const LivePose pose = *propagator.add(frame.imu.samples[i]);
        if (pose.health.has_pose() && T_truth_W && k > 100) at_readings += error2(pose.T_WB, pose.t), ++readings;
      }
      const Odometry o = estimator.process(frame).odometry;
      if (o.health.has_pose()) {
        const NavState<W> truth = motion.state(o.t.seconds());
        if (!T_truth_W) {
          const Quat turn = truth.T_FB.q * o.T_WB.q.conjugate();
          const Quat heading = Quat(turn.w(), 0, 0, turn.z()).normalized();
          T_truth_W = Pose<W, W>{heading, truth.T_FB.p - heading * o.T_WB.p};
        }
        if (k > 100) at_images += error2(o.T_WB, o.t), ++images;
      }
      propagator.rebase(o);
    }
    ASSERT_GT(images, 250);
    ASSERT_GT(readings, 2500);
    EXPECT_LT(std::sqrt(at_readings / readings), 1.2 * std::sqrt(at_images / images)) << seed;
  }
}

}  // namespace pose_statistics_test
}  // namespace fbvins
