// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_aiding.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace mavlink_aiding_test {

constexpr Time kNow{50'000'000'000};
constexpr Duration kOffset{7'000'000'000};    // the flight controller's clock is ahead
constexpr std::uint32_t kTheirs_ms = 56'990;  // 10 ms ago

MavlinkAiding all(int orientation = 25, ImuAxes axes = ImuAxes::flu) {
  MavlinkAidingOptions options;
  options.range = options.flow = options.pressure = true;
  options.orientation = orientation;
  MountingOptions mounting;
  mounting.imu_axes = axes;
  mounting.x_m = 0.1;  // the IMU is ahead of the flight controller
  return {options, mounting};
}

DistanceSensorMessage distance() {
  DistanceSensorMessage m;
  m.time_boot_ms = kTheirs_ms;
  m.min_distance = 20, m.max_distance = 800, m.current_distance = 143;
  m.covariance = 4;
  return m;
}

template <class Sample>
std::optional<Sample> read(const MavlinkMessage& message, MavlinkAiding aiding = all()) {
  const auto reading = aiding.read(message, kOffset, kNow);
  return reading ? std::optional(std::get<Sample>(*reading)) : std::nullopt;
}

TEST(MavlinkAiding, ARangefinderThatLooksDown) {
  const auto r = read<RangeSample>(distance());
  ASSERT_TRUE(r);
  EXPECT_EQ(r->t, Time{49'990'000'000}) << "on this machine's clock";
  EXPECT_NEAR(r->distance_m, 1.43, 1e-9);
  EXPECT_NEAR(r->sigma_m, 0.02, 1e-9);
  EXPECT_NEAR(r->nearest_m, 0.2, 1e-9);
  EXPECT_NEAR(r->farthest_m, 8, 1e-9);
  EXPECT_LT((r->direction_B - Vec3(0, 0, -1)).norm(), 1e-9) << "x forward, y left, z up";
  EXPECT_LT((r->p_B - Vec3(-0.1, 0, 0)).norm(), 1e-9);
}

TEST(MavlinkAiding, OtherOrientationsAreNotUsedUnlessConfigured) {
  DistanceSensorMessage m = distance();
  for (const int orientation : {0, 1, 2, 4, 6, 24, 100, 255}) {
    m.orientation = static_cast<std::uint8_t>(orientation);
    EXPECT_FALSE(read<RangeSample>(m)) << orientation;
  }
  m.orientation = 2;
  const auto right = read<RangeSample>(m, all(2));
  ASSERT_TRUE(right);
  EXPECT_LT((right->direction_B - Vec3(0, -1, 0)).norm(), 1e-9);
  EXPECT_FALSE(read<RangeSample>(distance(), all(2)));
  m.orientation = 7;  // that has no direction here
  EXPECT_FALSE(read<RangeSample>(m, all(7)));
}

TEST(MavlinkAiding, ACustomOrientationIsThatOfItsQuaternion) {
  DistanceSensorMessage m = distance();
  m.orientation = DistanceSensorMessage::kCustom;
  const Quat q = so3_exp(Vec3(0, -1.2, 0));  // nearly down
  m.quaternion = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())};
  const auto r = read<RangeSample>(m, all(100, ImuAxes::frd));
  ASSERT_TRUE(r);
  EXPECT_LT((r->direction_B - q * Vec3::UnitX()).norm(), 1e-6);
  m.quaternion = {};
  EXPECT_FALSE(read<RangeSample>(m, all(100)));
}

TEST(MavlinkAiding, InvalidRangesAreLeftOut) {
  DistanceSensorMessage m = distance();
  m.signal_quality = DistanceSensorMessage::kInvalid;
  EXPECT_FALSE(read<RangeSample>(m));
  m = distance(), m.max_distance = m.min_distance;
  EXPECT_FALSE(read<RangeSample>(m));
  m = distance(), m.time_boot_ms += 60'000;
  EXPECT_FALSE(read<RangeSample>(m)) << "of a clock that is not theirs";
  m = distance(), m.covariance = DistanceSensorMessage::kUnknownVariance;
  EXPECT_EQ(read<RangeSample>(m)->sigma_m, RangeSample{}.sigma_m);
}

TEST(MavlinkAiding, FlowOverAKnownDistanceIsAVelocity) {
  OpticalFlowRadMessage m;
  m.time_usec = 56'990'000, m.integration_time_us = 20'000;
  m.quality = 255, m.distance = 2;
  // 1 m/s ahead and 0.5 m/s to the right, 2 m above the ground, while it rolls and pitches.
  m.integrated_xgyro = 0.01f, m.integrated_ygyro = -0.02f;
  m.integrated_x = m.integrated_xgyro - 0.5f * 0.02f / 2, m.integrated_y = m.integrated_ygyro + 1.0f * 0.02f / 2;
  const auto v = read<VelocitySample>(m);
  ASSERT_TRUE(v);
  EXPECT_EQ(v->t, Time{49'980'000'000}) << "in the middle of the integration";
  EXPECT_LT((v->v_mps - Vec3(1, 0.5, 0)).norm(), 1e-5) << v->v_mps.transpose();
  EXPECT_LT((v->q_BS * v->v_mps - Vec3(1, -0.5, 0)).norm(), 1e-5) << "y left";
  EXPECT_EQ(v->sigma_mps.z(), kUnmeasured_mps);
  const double best = v->sigma_mps.x();
  m.quality = 85;
  EXPECT_NEAR(read<VelocitySample>(m)->sigma_mps.x(), 3 * best, 1e-9);
  for (auto spoil : {+[](OpticalFlowRadMessage& s) { s.quality = 0; }, +[](OpticalFlowRadMessage& s) { s.distance = -1; },
                     +[](OpticalFlowRadMessage& s) { s.distance = std::nanf(""); },
                     +[](OpticalFlowRadMessage& s) { s.integration_time_us = 0; },
                     +[](OpticalFlowRadMessage& s) { s.integrated_ygyro = std::nanf(""); },
                     +[](OpticalFlowRadMessage& s) { s.time_usec = ~std::uint64_t{0}; }}) {
    OpticalFlowRadMessage bad = m;
    spoil(bad);
    EXPECT_FALSE(read<VelocitySample>(bad));
  }
}

TEST(MavlinkAiding, PressureIsInPascals) {
  ScaledPressureMessage m;
  m.time_boot_ms = kTheirs_ms, m.press_abs = 1009.5f;
  EXPECT_NEAR(read<PressureSample>(m)->pressure_pa, 100'950, 0.01);
  m.press_abs = 0;
  EXPECT_FALSE(read<PressureSample>(m));
}

TEST(MavlinkAiding, WhatTheOptionsDoNotNameIsLeft) {
  MavlinkAiding none({}, {});
  EXPECT_FALSE(none.read(distance(), kOffset, kNow));
  EXPECT_TRUE(none.requests({1, 1}, kNow).empty());
}

TEST(MavlinkAiding, MessagesAreRequestedUntilTheyCome) {
  MavlinkAiding aiding = all();
  EXPECT_EQ(aiding.requests({1, 1}, kNow).size(), 3u);
  ASSERT_TRUE(aiding.read(distance(), kOffset, kNow));
  EXPECT_TRUE(aiding.requests({1, 1}, kNow + Duration{1'000'000'000}).empty());
  const auto later = aiding.requests({1, 1}, kNow + Duration{2'000'000'000});
  ASSERT_EQ(later.size(), 2u);
  EXPECT_EQ(later[0].params[0], static_cast<float>(OpticalFlowRadMessage::kId));
  EXPECT_EQ(later[0].params[1], 50'000.0f);
}

}  // namespace mavlink_aiding_test
}  // namespace fbvins
