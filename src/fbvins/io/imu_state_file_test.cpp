// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/imu_state_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>

namespace fbvins {
namespace imu_state_file_test {

ImuState state() {
  ImuState s;
  s.t = Time{1403636580838555648};
  s.biases.bias = {Vec3(1.0 / 3, -0.02, 0.03), Vec3(0.1, 2.0 / 7, -0.3)};
  s.biases.gyro_covariance << 2e-8, 1e-9, 0, 1e-9, 3e-8, 0, 0, 0, 4e-8;
  s.biases.accel_covariance << 1e-4, 1e-5, -1e-5, 1e-5, 2e-4, 0, -1e-5, 0, 3e-4;
  return s;
}

std::string text() { return imu_state_to_yaml(state(), {}); }

std::string with(const std::string& from, const std::string& to) {
  std::string out = text();
  const std::size_t at = out.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return out.replace(at, from.size(), to);
}

std::string complaint(const std::string& yaml, const ImuNoise& imu = {}) {
  const Result<ImuState> read = parse_imu_state(yaml, "imu.yaml", imu);
  return read ? "none" : read.error().message;
}

TEST(ImuStateFile, GivesBackTheSameBits) {
  const Result<ImuState> read = parse_imu_state(text(), "imu.yaml", {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->t, state().t);
  EXPECT_EQ(read->biases.bias.gyro_radps, state().biases.bias.gyro_radps);
  EXPECT_EQ(read->biases.bias.accel_mps2, state().biases.bias.accel_mps2);
  EXPECT_EQ(read->biases.gyro_covariance, state().biases.gyro_covariance);
  EXPECT_EQ(read->biases.accel_covariance, state().biases.accel_covariance);
}

TEST(ImuStateFile, ATimeOffsetIsThereWholeOrNotAtAll) {
  EXPECT_FALSE(parse_imu_state(text(), "imu.yaml", {})->time_offset) << "as in files of before";
  ImuState with_offset = state();
  with_offset.time_offset = TimeOffsetEstimate{-0.05 / 3, 0.001};
  const std::string yaml = imu_state_to_yaml(with_offset, {});
  const Result<ImuState> read = parse_imu_state(yaml, "imu.yaml", {});
  ASSERT_TRUE(read && read->time_offset);
  EXPECT_EQ(read->time_offset->s, with_offset.time_offset->s);
  EXPECT_EQ(read->time_offset->sigma_s, with_offset.time_offset->sigma_s);
  EXPECT_NE(complaint(text() + "time_offset_s: 0.01\n").find("time_offset_sigma_s"), std::string::npos);
  EXPECT_NE(complaint(text() + "time_offset_s: 9\ntime_offset_sigma_s: 0.001\n").find("time_offset_s: is more than 5 s"),
            std::string::npos);
  EXPECT_NE(complaint(text() + "time_offset_s: 0\ntime_offset_sigma_s: 0\n").find("is not a standard deviation"),
            std::string::npos);
  EXPECT_NE(complaint(text() + "time_offset_s: .nan\ntime_offset_sigma_s: 1\n").find("time_offset_s"), std::string::npos);
}

TEST(ImuStateFile, AFileOfAnotherImuIsRefused) {
  ImuNoise other;
  other.accel_random_walk_mps3_rthz = 4e-3;
  EXPECT_NE(complaint(text(), other).find("imu.yaml:5: imu: is another IMU than the one of this flight"), std::string::npos)
      << complaint(text(), other);
}

TEST(ImuStateFile, WhatIsNotWholeIsRefusedWithItsPlace) {
  EXPECT_NE(complaint("").find("imu.yaml"), std::string::npos);
  EXPECT_NE(complaint(text().substr(0, text().size() / 2)).find("imu.yaml"), std::string::npos);
  EXPECT_NE(complaint(with("imu_state: 1", "imu_state: 2")).find("imu_state: version 2 is not known"), std::string::npos);
  EXPECT_NE(complaint(with("t_ns: 14", "t_ns: 1x4")).find("is not a time in nanoseconds"), std::string::npos);
  EXPECT_NE(complaint(with("gyro_bias_radps: [0.3", "gyro_bias_radps: [9.3")).find("gyro_bias_radps: is more than 1"),
            std::string::npos);
  EXPECT_NE(complaint(with("accel_bias_mps2: [0.1", "accel_bias_mps2: [.nan")).find("accel_bias_mps2"), std::string::npos);
  EXPECT_NE(complaint(with("accel_bias_covariance: [0.0001", "accel_bias_covariance: [-0.0001")).find("is not a covariance"),
            std::string::npos);
  EXPECT_NE(complaint(text() + "more: 1\n").find("more"), std::string::npos);
}

TEST(ImuStateFile, ThereIsNoneBeforeTheFirstFlight) {
  const std::string path = ::testing::TempDir() + "/imu_state_file_test.yaml";
  std::filesystem::remove(path);
  const auto none = read_imu_state(path, {});
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->has_value());
  ASSERT_TRUE(write_imu_state(path, state(), {}));
  const auto kept = read_imu_state(path, {});
  ASSERT_TRUE(kept && kept->has_value());
  EXPECT_EQ((*kept)->t, state().t);
  EXPECT_FALSE(read_imu_state(::testing::TempDir(), {}));  // a folder
  EXPECT_FALSE(write_imu_state(path + "/no/such/folder", state(), {}));
  std::filesystem::remove(path);
}

}  // namespace imu_state_file_test
}  // namespace fbvins
