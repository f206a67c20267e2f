// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/reading_faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "fbvins/checkup/first_seconds.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins {
namespace reading_faults_test {

std::vector<ImuSample> readings() {
  return test::Motion(0.3, 0.3).segment(Time{1'000'000'000}, Time{7'000'000'000}, Duration{5'000'000}).samples;
}

bool says(const std::vector<Finding>& findings, FindingKind kind) {
  return std::ranges::find(findings, kind, &Finding::kind) != findings.end();
}

TEST(ReadingFaults, NamesAnAxisThatIsStuck) {
  EXPECT_TRUE(check_readings(readings()).empty());
  auto dead = readings(), held = readings(), all = readings(), at_rest = readings();
  for (std::size_t i = 0; i < dead.size(); ++i) {
    dead[i].gyro_radps.z() = 0, all[i].gyro_radps.setZero();
    if (i > 500) held[i].accel_mps2.y() = held[500].accel_mps2.y();
    at_rest[i].gyro_radps = Vec3(0.001 * static_cast<double>(i % 2), 0, 0);  // one step of the resolution, and none
  }
  ASSERT_EQ(check_readings(dead).size(), 1u);
  EXPECT_EQ(check_readings(dead).front().measured, "axis z of the gyroscope reads a constant 0");
  EXPECT_NE(check_readings(all).at(0).measured.find("the gyroscope reads a constant (0, 0, 0)"), std::string::npos);
  EXPECT_NE(check_readings(held).at(0).measured.find("axis y of the accelerometer reads a constant"), std::string::npos);
  EXPECT_TRUE(check_readings(at_rest).empty());
  FirstSeconds look({});
  for (const ImuSample& sample : dead) look.push(sample);
  EXPECT_TRUE(says(look.findings(), FindingKind::imu_stuck));
}

TEST(ReadingFaults, NamesSpikesAndLeavesThemOut) {
  auto spiky = readings(), shocks = readings(), vibrating = readings();
  for (std::size_t i = 100; i < spiky.size(); i += 200) spiky[i].gyro_radps.y() += 20, spiky[i + 1].accel_mps2.x() -= 80;
  shocks[300].accel_mps2.z() += 80, shocks[700].accel_mps2.z() += 80;
  for (std::size_t i = 0; i < vibrating.size(); ++i) vibrating[i].accel_mps2.z() += i % 2 == 0 ? 40 : -40;
  const Spikes spikes = find_spikes(spiky);
  EXPECT_EQ(spikes.gyro, 6);
  EXPECT_EQ(spikes.accel, 6);
  EXPECT_TRUE(says(check_readings(spiky), FindingKind::imu_spikes));
  const auto cleaned = without(spikes, spiky), as_they_were = readings();
  for (std::size_t i = 0; i < cleaned.size(); ++i) {
    EXPECT_LT((cleaned[i].gyro_radps - as_they_were[i].gyro_radps).norm(), 0.05);
    EXPECT_LT((cleaned[i].accel_mps2 - as_they_were[i].accel_mps2).norm(), 0.5);
  }
  EXPECT_TRUE(check_readings(shocks).empty());
  EXPECT_TRUE(check_readings(vibrating).empty());
}

}  // namespace reading_faults_test
}  // namespace fbvins
