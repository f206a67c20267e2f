// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/live_estimate.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace live_estimate_test {

Time at(double s) { return Time{Duration::from_seconds(100 + s).ns}; }

/// At rest.
ImuSample reading(double s) { return {at(s), Vec3::Zero(), Vec3(0, 0, kGravity_mps2)}; }

Odometry estimate(double s, std::uint32_t reset_counter) {
  Odometry o;
  o.t = at(s);
  o.T_WB.p = Vec3(1, 2, 3);
  o.health = {HealthState::good, HealthReason::none};
  o.pose_covariance = 1e-6 * Mat6::Identity();
  o.velocity_covariance = 1e-4 * Mat3::Identity();
  o.reset_counter = reset_counter;
  return o;
}

Ingest::Arrival arrivals(double imu_s, double images_s) {
  return {at(imu_s), at(images_s), {{at(images_s), {}}, {at(images_s), {}}}, {}, {}};
}

TEST(LiveEstimate, PosesHaveTheHealthThatEstimatorAndSensorsHaveTogether) {
  LiveEstimate live(PosePropagator({}, {}, 0.1), SensorWatch(LiveOptions{}, {}), 7, at(0));
  const std::optional<LivePose> before = live.add(reading(0), at(0));
  ASSERT_TRUE(before);
  EXPECT_EQ(before->health.state, HealthState::initialising);
  EXPECT_EQ(before->reset_counter, 7u) << "before the first estimate, too";

  EXPECT_FALSE(live.add(estimate(0, 7), at(0))) << "readings carry it on";
  EXPECT_TRUE(live.judge(arrivals(0.01, 0), at(0.01)));
  EXPECT_FALSE(live.judge(arrivals(0.02, 0), at(0.02))) << "still good";
  std::optional<LivePose> pose;
  for (int i = 1; i <= 10; ++i) pose = live.add(reading(0.005 * i), at(0.005 * i));
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->health.state, HealthState::good);
  EXPECT_EQ(pose->host_t, at(0.05));
  EXPECT_LT((pose->T_WB.p - Vec3(1, 2, 3)).norm(), 1e-3);

  EXPECT_TRUE(live.judge(arrivals(0.3, 0), at(0.3))) << "no images";
  pose = live.add(reading(0.055), at(0.3));
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->health, (Health{HealthState::degraded, HealthReason::no_images}));
}

TEST(LiveEstimate, CountsImagesAndRestarts) {
  LiveEstimate live(PosePropagator({}, {}, 0.1), SensorWatch(LiveOptions{}, {}), 7, at(0));
  const std::optional<LivePose> alone = live.add(estimate(0, 7), at(0.02));
  ASSERT_TRUE(alone) << "no reading carries it on";
  EXPECT_EQ(alone->host_t, at(0.02));
  (void)live.add(estimate(0.05, 9), at(0.07));
  (void)live.add(reading(0.05), at(0.09));
  LiveStatus status;
  live.tell(status);
  EXPECT_EQ(status.counts.images_estimated, 2);
  EXPECT_EQ(status.counts.resets, 2);
  EXPECT_EQ(status.reset_counter, 9u);
  EXPECT_EQ(status.pose_age.count, 1);
  EXPECT_NEAR(status.pose_age.max_ms, 20, 1e-6);
}

}  // namespace live_estimate_test
}  // namespace fbvins
