// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/motion_merge.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace fbvins {
namespace motion_merge_test {

Vec3 force(double t_s) { return Vec3(3 + t_s, -2 * t_s, 9.8); }
Vec3 rate(double t_s) { return Vec3(std::sin(t_s), 0, t_s); }
Time at(double t_s) { return Time{} + Duration::from_seconds(t_s); }

std::vector<ImuSample> all(MotionMerge& merge) {
  std::vector<ImuSample> samples;
  while (auto sample = merge.next()) samples.push_back(*sample);
  return samples;
}

TEST(MotionMerge, GivesEveryRateTheForceOfItsMoment) {
  MotionMerge merge;
  std::vector<ImuSample> samples;
  // 200 and 62.5 a second, begun out of step; forces come 20 ms late.
  for (int ms = 0; ms < 2000; ++ms) {
    if (ms % 5 == 0) merge.add_gyro(at(ms * 1e-3), rate(ms * 1e-3));
    if (ms % 16 == 3 && ms >= 20) merge.add_accel(at((ms - 20) * 1e-3), force((ms - 20) * 1e-3));
    for (const ImuSample& sample : all(merge)) samples.push_back(sample);
  }
  ASSERT_GT(samples.size(), 385u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = samples[i].t.seconds();
    EXPECT_LT((samples[i].accel_mps2 - force(t)).norm(), 1e-9) << t;
    EXPECT_LT((samples[i].gyro_radps - rate(t)).norm(), 1e-12) << t;
    if (i > 0) {
      EXPECT_EQ((samples[i].t - samples[i - 1].t).ns, 5'000'000);
    }
  }
}

TEST(MotionMerge, MakesNothingUpWhereTheAccelerometerIsSilent) {
  MotionMerge merge;
  for (int ms = 0; ms <= 300; ms += 5) merge.add_gyro(at(ms * 1e-3), Vec3::Zero());
  for (int ms : {0, 10, 20, 200, 210}) merge.add_accel(at(ms * 1e-3), Vec3::UnitZ());
  std::vector<std::int64_t> left_ms;
  for (const ImuSample& sample : all(merge)) left_ms.push_back(sample.t.ns / 1'000'000);
  EXPECT_EQ(left_ms, (std::vector<std::int64_t>{0, 5, 10, 15, 20, 200, 205, 210}));
  EXPECT_EQ(merge.left_out(), 35) << "from 25 to 195 ms";
}

TEST(MotionMerge, DropsReadingsThatGoBackAndKeepsABoundedNumber) {
  MotionMerge merge;
  merge.add_accel(at(0), Vec3::Zero());
  merge.add_accel(at(0.01), Vec3::UnitX());
  merge.add_accel(at(0.005), Vec3::UnitY());
  merge.add_gyro(at(0.01), Vec3::UnitZ());
  merge.add_gyro(at(0.01), Vec3::Zero());
  const auto samples = all(merge);
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(samples[0].accel_mps2, Vec3(Vec3::UnitX()));
  EXPECT_EQ(merge.left_out(), 2);
  for (int i = 0; i < 100000; ++i) merge.add_gyro(at(1 + i * 0.005), Vec3::Zero());
  merge.add_accel(at(600), Vec3::Zero());
  merge.add_accel(at(600.01), Vec3::Zero());
  EXPECT_TRUE(all(merge).empty());
}

}  // namespace motion_merge_test
}  // namespace fbvins
