// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/gyro_turns.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace gyro_turns_test {

const Vec3 kRate(0.4, -0.3, 1);

Time at(double t_s) { return Time{} + Duration::from_seconds(100 + t_s); }

/// Readings each 5 ms on the IMU's clock, by an image's at `to_s`.
ImuSegment segment(double from_s, double to_s, double offset_s = 0) {
  ImuSegment out;
  out.time_offset = Duration::from_seconds(offset_s);
  out.longest_gap = Duration::from_seconds(0.005);
  for (double t = from_s; t < to_s + 1e-9; t += 0.005) out.samples.push_back(ImuSample{at(t), kRate, Vec3::Zero()});
  return out;
}

TEST(GyroTurns, TurnsAsTheReadingsSay) {
  GyroTurns turns;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(turns.add(segment(0.05 * i, 0.05 * (i + 1)), at(0.05 * (i + 1))));
  EXPECT_LT((so3_log(turns.between(at(0.1003), at(0.2511))) - 0.1508 * kRate).norm(), 1e-6);
  EXPECT_LT((turns.rate(at(0.2)) - kRate).norm(), 1e-6);
  turns.forget_before(at(0.2));
  EXPECT_NEAR((turns.first() - at(0.2)).seconds(), 0, 0.006);
}

TEST(GyroTurns, AnOffsetThatIsCorrectedDownwardsLosesNothing) {
  GyroTurns turns;
  ASSERT_TRUE(turns.add(segment(0, 0.1), at(0.1)));
  ImuSegment nothing;  // up to a moment that was before
  nothing.time_offset = Duration::from_seconds(-0.08);
  EXPECT_TRUE(turns.add(nothing, at(0.15)));
  EXPECT_FALSE(turns.empty());
  nothing.time_offset = {};
  EXPECT_FALSE(turns.add(nothing, at(0.2))) << "a gap";
  EXPECT_TRUE(turns.empty());
}

TEST(GyroTurns, AGapForgets) {
  GyroTurns turns;
  ASSERT_TRUE(turns.add(segment(0, 0.1), at(0.1)));
  ImuSegment late = segment(0.2, 0.3);
  late.longest_gap = Duration::from_seconds(0.1);
  EXPECT_FALSE(turns.add(late, at(0.3)));
  EXPECT_GT(turns.first(), at(0.15));
}

}  // namespace gyro_turns_test
}  // namespace fbvins
