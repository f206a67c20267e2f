// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/reading_judge.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace fbvins {
namespace reading_judge_test {

constexpr Time ms(int t) { return Time{std::int64_t{t} * 1'000'000}; }

ImuSample reading(int t_ms, double x = 0) { return {ms(t_ms), Vec3(0.3, x, 0), Vec3(0, 1, 9 + x)}; }

TEST(ReadingJudge, RefusesWhatTheSensorCannotHaveMeasured) {
  ImuNoise imu;
  imu.max_gyro_radps = 8.8, imu.max_accel_mps2 = 40;
  ReadingJudge judge(imu);
  int t = 0;
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e6, 3e38, 1e200, -41.0}) {
    ImuSample gyro = reading(t + 5, 0.01 * t), accel = reading(t + 10, 0.01 * t);
    t += 10;
    gyro.gyro_radps.z() = accel.accel_mps2.x() = wrong;
    EXPECT_FALSE(judge.accepts(gyro)) << wrong;
    EXPECT_FALSE(judge.accepts(accel)) << wrong;
  }
  EXPECT_EQ(judge.counts().invalid, 12);
  ImuSample strong = reading(t + 5);
  strong.accel_mps2.x() = -40;
  EXPECT_TRUE(judge.accepts(strong)) << "the range is the calibration's";
}

TEST(ReadingJudge, RefusesStampsThatDoNotIncrease) {
  ReadingJudge judge;
  EXPECT_TRUE(judge.accepts(reading(10)));
  EXPECT_FALSE(judge.accepts(reading(10, 1)));
  EXPECT_FALSE(judge.accepts(reading(5, 1)));
  EXPECT_TRUE(judge.accepts(reading(15, 1)));
  EXPECT_EQ(judge.counts().duplicate, 1);
  EXPECT_EQ(judge.counts().backward, 1);
  EXPECT_EQ(judge.counts().accepted, 2);
}

TEST(ReadingJudge, RefusesASensorThatRepeatsItself) {
  ReadingJudge judge;
  int accepted = 0;
  for (int t = 0; t < 2000; t += 5) accepted += judge.accepts(reading(t));
  EXPECT_EQ(accepted, 11) << "50 ms of it may be chance";
  EXPECT_EQ(judge.counts().repeated, 389);
  EXPECT_FALSE(judge.accepts(reading(1990, 1))) << "time goes on meanwhile";
  EXPECT_TRUE(judge.accepts(reading(2000, 1))) << "it measures again";
}

TEST(ReadingJudge, ASimulatedSensorAtRestMayRepeatItself) {
  ReadingJudge judge;
  for (int t = 0; t < 2000; t += 5) EXPECT_TRUE(judge.accepts({ms(t), Vec3::Zero(), Vec3(0, 0, 9.81)}));
}

TEST(ReadingJudge, WhatItAcceptedItAcceptsAgain) {
  ReadingJudge first, second;
  for (int t = 0; t < 5000; t += 5) {
    const ImuSample sample = reading(t % 70 == 0 ? t - 20 : t, t < 2000 ? 0 : (t / 15) % 3);
    EXPECT_TRUE(!first.accepts(sample) || second.accepts(sample)) << t;
  }
  EXPECT_GT(first.counts().repeated, 0);
  EXPECT_GT(first.counts().backward, 0);
}

}  // namespace reading_judge_test
}  // namespace fbvins
