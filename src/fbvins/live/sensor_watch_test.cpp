// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/sensor_watch.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace sensor_watch_test {

Time at(double s) { return Time{Duration::from_seconds(s).ns}; }

const Health kGood{HealthState::good, HealthReason::none};

Ingest::Arrival arrivals(double imu_s, double left_s, double right_s) {
  return {at(imu_s), at(std::max(left_s, right_s)), {{at(left_s), {}}, {at(right_s), {}}}, {}, {}};
}

Health judged(const Health& estimated, const Ingest::Arrival& a, double now_s) {
  return SensorWatch(LiveOptions{}, {}).judge({estimated, a.image}, a, at(0), at(now_s));
}

TEST(SensorWatch, SaysWhatTheEstimatorSaysWhileAllIsWell) {
  EXPECT_EQ(judged(kGood, arrivals(9.99, 9.95, 9.95), 10), kGood);
  const Health few{HealthState::degraded, HealthReason::few_tracks};
  EXPECT_EQ(judged(few, arrivals(9.99, 9.95, 9.95), 10), few);
}

TEST(SensorWatch, SilenceIsSeenAndNamed) {
  using enum HealthReason;
  EXPECT_EQ(judged(kGood, arrivals(9.99, 9.7, 9.7), 10), (Health{HealthState::degraded, no_images}));
  EXPECT_EQ(judged(kGood, arrivals(9.99, 9.7, 9.99), 10), (Health{HealthState::degraded, one_camera, 0b01}));
  EXPECT_EQ(judged(kGood, arrivals(9.8, 9.99, 9.99), 10), (Health{HealthState::degraded, imu_gap}));
  EXPECT_EQ(judged(kGood, arrivals(9.8, 9.7, 9.7), 10), (Health{HealthState::degraded, imu_gap}));
}

TEST(SensorWatch, EveryCameraOfTheRigIsWatched) {
  using enum HealthReason;
  Ingest::Arrival four = arrivals(9.99, 9.99, 9.99);
  four.cameras.push_back({at(9.7), {}});
  four.cameras.push_back({at(9.95), {}});
  EXPECT_EQ(judged(kGood, four, 10), (Health{HealthState::degraded, one_camera, 0b100}));
  four.cameras[2].period = Duration::from_seconds(0.15);
  EXPECT_EQ(judged(kGood, four, 10), kGood) << "it has a lower rate";
  four.imu = four.image = four.cameras[0].image = four.cameras[1].image = four.cameras[3].image = at(10.09);
  EXPECT_EQ(judged(kGood, four, 10.1), (Health{HealthState::degraded, one_camera, 0b100}));
}

TEST(SensorWatch, ARigOfOneCameraLacksNone) {
  Ingest::Arrival one{at(9.99), at(9.95), {{at(9.95), {}}}, {}, {}};
  EXPECT_EQ(judged(kGood, one, 10), kGood);
  one.image = one.cameras[0].image = at(9.7);
  EXPECT_EQ(judged(kGood, one, 10), (Health{HealthState::degraded, HealthReason::no_images}));
}

TEST(SensorWatch, ASlowCameraIsNotSilent) {
  Ingest::Arrival slow = arrivals(9.99, 9.6, 9.6);
  slow.image_period = Duration::from_seconds(0.2);
  EXPECT_EQ(judged(kGood, slow, 10), kGood) << "5 Hz";
  EXPECT_EQ(judged(kGood, slow, 10.11), (Health{HealthState::degraded, HealthReason::imu_gap}));
  slow.imu = at(10.11);
  EXPECT_EQ(judged(kGood, slow, 10.11), (Health{HealthState::degraded, HealthReason::no_images}));
}

TEST(SensorWatch, APoseThatTheImuCarriesIsLostByItsUncertaintyAndNotByTime) {
  const SensorWatch watch(LiveOptions{}, {});
  const Ingest::Arrival a = arrivals(9.99, 2, 2);
  EXPECT_EQ(watch.judge({kGood, at(2), 0.3, 0.57}, a, at(0), at(10)), (Health{HealthState::degraded, HealthReason::no_images}));
  EXPECT_EQ(watch.judge({kGood, at(2), 0.3, 0.59}, a, at(0), at(10)), (Health{HealthState::lost, HealthReason::no_images}));
}

TEST(SensorWatch, APoseThatNothingCarriesIsLost) {
  EXPECT_EQ(judged(kGood, arrivals(8.9, 8.9, 8.9), 10), (Health{HealthState::lost, HealthReason::imu_gap}));
  EXPECT_EQ(judged(kGood, arrivals(8.9, 9.99, 9.99), 10), (Health{HealthState::degraded, HealthReason::imu_gap}));
}

TEST(SensorWatch, ImagesThatComeAgainAreNoPoseYet) {
  const SensorWatch watch(LiveOptions{}, {});
  EXPECT_EQ(watch.judge({kGood, at(8)}, arrivals(9.99, 9.99, 9.99), at(0), at(10)),
            (Health{HealthState::degraded, HealthReason::no_images}));
  EXPECT_EQ(watch.judge({kGood, at(6), 0.1, 0.6}, arrivals(9.99, 9.99, 9.99), at(0), at(10)),
            (Health{HealthState::lost, HealthReason::no_images}));
}

/// Images wait a quarter of a second for readings that are missing.
TEST(SensorWatch, LateEstimatesKeepTheirReason) {
  const Health gap{HealthState::degraded, HealthReason::imu_gap};
  const SensorWatch watch(LiveOptions{}, {});
  EXPECT_EQ(watch.judge({gap, at(9.7)}, arrivals(9.99, 9.99, 9.99), at(0), at(10)), gap);
  EXPECT_EQ(watch.judge({gap, at(9.7)}, arrivals(9.99, 9.7, 9.7), at(0), at(10)),
            (Health{HealthState::degraded, HealthReason::no_images}));
  EXPECT_EQ(watch.judge({gap, at(9.7)}, arrivals(4, 9.99, 9.99), at(0), at(10)), gap) << "the IMU is silent for good";
}

TEST(SensorWatch, BeforeTheFirstPoseItOnlySaysWhatIsMissing) {
  const Health waiting{HealthState::initialising, HealthReason::waiting_for_motion_or_rest};
  EXPECT_EQ(judged(waiting, {}, 1), (Health{HealthState::initialising, HealthReason::imu_gap}));
  EXPECT_EQ(judged(waiting, arrivals(0.99, 0, 0), 1), (Health{HealthState::initialising, HealthReason::no_images}));
  EXPECT_EQ(judged(waiting, {}, 0.05), waiting);
}

}  // namespace sensor_watch_test
}  // namespace fbvins
