// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/keyframe_readings.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace keyframe_readings_test {

Time at(int ms) { return Time{} + Duration::from_seconds(0.001 * ms); }

/// Readings every 5 ms, both ends included.
ImuSegment between(int from_ms, int to_ms) {
  ImuSegment segment;
  for (int ms = from_ms; ms <= to_ms; ms += 5) segment.samples.push_back({at(ms)});
  return segment;
}

TEST(KeyframeReadings, GoFromKeyframeToKeyframe) {
  KeyframeReadings readings;
  for (int ms = 0; ms < 500; ms += 50) readings.add(between(ms, ms + 50));
  (void)readings.until(at(100));
  const std::vector<ImuSegment> imu = readings.until(at(300));
  ASSERT_EQ(imu.size(), 4u);
  EXPECT_EQ(imu.front().samples.front().t, at(100));
  EXPECT_EQ(imu.back().samples.back().t, at(300));
  EXPECT_EQ(readings.until(at(350)).size(), 1u);
}

TEST(KeyframeReadings, WhereSomeAreMissingThereAreNone) {
  KeyframeReadings readings;
  readings.add(between(0, 50));
  (void)readings.until(at(50));
  readings.add(between(50, 100));
  readings.add({});  // 100 to 150 ms
  readings.add(between(150, 200));
  EXPECT_TRUE(readings.until(at(200)).empty());
  readings.add(between(200, 250));
  EXPECT_EQ(readings.until(at(250)).size(), 1u) << "the next interval is whole again";
  readings.add({});
  EXPECT_TRUE(readings.until(at(300)).empty());
}

/// A camera that was silent for long has one segment for all that time.
TEST(KeyframeReadings, AnIntervalMayBeLongerThanOldOnesAreKept) {
  KeyframeReadings readings;
  readings.add(between(0, 50));
  (void)readings.until(at(50));
  readings.add(between(50, 11'050));
  EXPECT_EQ(readings.until(at(11'050)).size(), 1u);
  readings.add(between(11'050, 31'050));
  readings.add(between(31'050, 31'100));
  EXPECT_TRUE(readings.until(at(31'100)).empty()) << "the long one is older than ten seconds";
}

TEST(KeyframeReadings, OfAKeyframeThatIsLeftOutGoToTheNext) {
  KeyframeReadings readings;
  for (int ms = 0; ms < 500; ms += 50) readings.add(between(ms, ms + 50));
  (void)readings.until(at(100));
  readings.take_back(readings.until(at(200)));
  readings.take_back(readings.until(at(250)));
  const std::vector<ImuSegment> imu = readings.until(at(300));
  ASSERT_EQ(imu.size(), 4u);
  EXPECT_EQ(imu.front().samples.front().t, at(100));
}

TEST(KeyframeReadings, OldOnesAreDropped) {
  KeyframeReadings readings;
  for (int i = 0; i < 400; ++i) readings.add(between(50 * i, 50 * (i + 1)));
  EXPECT_TRUE(readings.until(at(20'000)).empty()) << "the first ten seconds are gone";
}

}  // namespace keyframe_readings_test
}  // namespace fbvins
