// SPDX-License-Identifier: Apache-2.0
#include "apps/imu_state.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace imu_state_test {

Odometry with_bias() {
  Odometry o;
  o.t = Time{5};
  o.health = {HealthState::good, HealthReason::none};
  o.bias.gyro_radps = Vec3(0.01, 0.02, 0.03);
  o.gyro_bias_covariance = o.accel_bias_covariance = 1e-4 * Mat3::Identity();
  return o;
}

TEST(ImuStateOfAFlight, IsThatOfFramesInGoodHealth) {
  Odometry o = with_bias();
  ASSERT_TRUE(imu_state_of(o, 0));
  EXPECT_EQ(imu_state_of(o, 0)->biases.bias.gyro_radps, o.bias.gyro_radps);
  o.health.state = HealthState::degraded;
  EXPECT_FALSE(imu_state_of(o, 0));
  o = with_bias();
  o.accel_bias_covariance.setZero();  // before the window knows it
  EXPECT_FALSE(imu_state_of(o, 0));
}

TEST(ImuStateOfAFlight, WithoutAPathOrAStateNothingIsReadOrWritten) {
  const auto none = load_imu_state("", ImuNoise{});
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  EXPECT_TRUE(save_imu_state("", imu_state_of(with_bias(), 0), ImuNoise{}));
  const test::Folder folder("no_imu_state");
  const std::string path = folder.path() + "/imu.yaml";
  EXPECT_TRUE(save_imu_state(path, std::nullopt, ImuNoise{}));
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ImuStateOfAFlight, ComesBack) {
  const test::Folder folder("imu_state");
  const std::string path = folder.path() + "/imu.yaml";
  ASSERT_TRUE(save_imu_state(path, imu_state_of(with_bias(), 0), ImuNoise{}));
  const auto loaded = load_imu_state(path, ImuNoise{});
  ASSERT_TRUE(loaded) << loaded.error().message;
  ASSERT_TRUE(*loaded);
  EXPECT_EQ((*loaded)->biases.bias.gyro_radps, with_bias().bias.gyro_radps);
}

TEST(ImuStateOfAFlight, HasTheWholeTimeOffset) {
  Odometry o = with_bias();
  EXPECT_FALSE(imu_state_of(o, 0.01)->time_offset) << "not looked for";
  o.time_offset_s = -0.05, o.time_offset_sigma_s = 0.001;
  EXPECT_NEAR(imu_state_of(o, 0.01)->time_offset->s, -0.04, 1e-15);
  EXPECT_EQ(imu_state_of(o, 0.01)->time_offset->sigma_s, 0.001);
}

}  // namespace imu_state_test
}  // namespace fbvins::app
