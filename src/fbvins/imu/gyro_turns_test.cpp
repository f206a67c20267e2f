// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/gyro_turns.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace gyro_turns_test {

const Vec3 kRate(0.4, -0.3, 1);

Time at(double t_s) { return Time{} + Duration::from_seconds(100 + t_s); }

/// Readings each 5 ms.
ImuSegment segment(double from_s, double to_s) {
  ImuSegment out;
  for (double t = from_s; t < to_s + 1e-9; t += 0.005) out.samples.push_back(ImuSample{at(t), kRate, Vec3::Zero()});
  return out;
}

TEST(GyroTurns, TurnsAsTheReadingsSay) {
  GyroTurns turns;
  for (int i = 0; i < 10; ++i) turns.add(segment(0.05 * i, 0.05 * (i + 1)));
  EXPECT_LT((so3_log(turns.between(at(0.1003), at(0.2511))) - 0.1508 * kRate).norm(), 1e-6);
  const TurnAround around = turns.around(at(0.2), GyroTurns::kLeastSide);
  EXPECT_LT((around.rate - kRate).norm(), 1e-6);
  EXPECT_LT(around.gain.norm(), 1e-3);
  turns.forget_before(at(0.2));
  EXPECT_NEAR((turns.first() - at(0.2)).seconds(), 0, 0.006);
}

TEST(GyroTurns, AParabolaWhereTheRateChanges) {
  GyroTurns turns;
  ImuSegment changing = segment(0, 0.5);
  for (ImuSample& s : changing.samples) s.gyro_radps = (s.t - at(0)).seconds() * Vec3(0, 20, 0);
  turns.add(changing);
  const TurnAround around = turns.around(at(0.25), Duration::from_seconds(0.012));
  EXPECT_LT((around.rate - Vec3(0, 5, 0)).norm(), 1e-3);
  EXPECT_LT((around.gain - Vec3(0, 20, 0)).norm(), 1);
  EXPECT_LT((around.after(0.01) - Vec3(0, 0.051, 0)).norm(), 2e-4);
}

TEST(GyroTurns, AnOffsetThatIsCorrectedLosesNothing) {
  GyroTurns turns;
  turns.add(segment(0, 0.1));
  turns.add(ImuSegment{});        // corrected downwards: up to a moment that was before
  turns.add(segment(0.07, 0.2));  // and again a part of what is known
  EXPECT_TRUE(turns.covers(at(0.02), at(0.18)));
  EXPECT_LT((so3_log(turns.between(at(0.02), at(0.18))) - 0.16 * kRate).norm(), 1e-6);
}

TEST(GyroTurns, NothingIsKnownAcrossAGap) {
  GyroTurns turns;
  EXPECT_FALSE(turns.covers(at(0), at(0)));
  turns.add(segment(0, 0.2));
  turns.add(segment(0.4, 0.6));
  EXPECT_TRUE(turns.covers(at(0.05), at(0.15)));
  EXPECT_TRUE(turns.covers(at(0.45), at(0.55)));
  EXPECT_FALSE(turns.covers(at(0.15), at(0.45)));
  EXPECT_FALSE(turns.covers(at(0.25), at(0.35)));
  EXPECT_LT((so3_log(turns.between(at(0.42), at(0.52))) - 0.1 * kRate).norm(), 1e-6);
}

}  // namespace gyro_turns_test
}  // namespace fbvins
