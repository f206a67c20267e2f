// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_buffer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace fbvins {
namespace {

constexpr Time ms(double t) { return Time{static_cast<std::int64_t>(t * 1e6)}; }

/// A reading whose numbers are linear in time, so that interpolation is exact.
ImuSample ramp(double t_ms) { return {ms(t_ms), Vec3(t_ms, 2 * t_ms, 0) * 1e-3, Vec3(0, 0, 9 + t_ms * 1e-3)}; }

ImuBuffer filled(int from_ms, int to_ms) {
  ImuBuffer buffer;
  for (int t = from_ms; t <= to_ms; t += 5) buffer.push(ramp(t));
  return buffer;
}

TEST(ImuBuffer, InterpolatesBothEnds) {
  ImuBuffer buffer = filled(0, 100);
  const auto segment = buffer.extract(ms(12), ms(33));
  ASSERT_TRUE(segment.has_value());
  ASSERT_EQ(segment->samples.size(), 6u);  // 12, 15, 20, 25, 30, 33
  EXPECT_EQ(segment->samples.front().t, ms(12));
  EXPECT_EQ(segment->samples.back().t, ms(33));
  EXPECT_NEAR(segment->samples.front().gyro_radps.x(), 0.012, 1e-12);
  EXPECT_NEAR(segment->samples.back().accel_mps2.z(), 9.033, 1e-12);
  EXPECT_EQ(segment->longest_gap.ns, 5'000'000);
}

TEST(ImuBuffer, NeighbouringSegmentsShareTheirEnd) {
  ImuBuffer buffer = filled(0, 200);
  const auto a = buffer.extract(ms(0), ms(51)), b = buffer.extract(ms(51), ms(100));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->samples.back().t, b->samples.front().t);
  EXPECT_EQ(a->samples.back().gyro_radps, b->samples.front().gyro_radps);
  EXPECT_EQ(b->samples.back().t, ms(100));
  EXPECT_EQ(b->samples[b->samples.size() - 2].t, ms(95)) << "a reading on the stamp appears once";
}

TEST(ImuBuffer, WaitsForTheReadingAfterTheStamp) {
  ImuBuffer buffer = filled(0, 48);
  EXPECT_FALSE(buffer.covers(ms(50)));
  EXPECT_FALSE(buffer.extract(ms(0), ms(50)).has_value());
  buffer.push(ramp(50));
  EXPECT_TRUE(buffer.covers(ms(50)));
  EXPECT_TRUE(buffer.extract(ms(0), ms(50)).has_value());
  EXPECT_FALSE(buffer.extract(ms(50), ms(50)).has_value()) << "an interval of no length has no segment";
}

TEST(ImuBuffer, CountsWhatItRejects) {
  ImuBuffer buffer = filled(0, 20);
  EXPECT_FALSE(buffer.push(ramp(20)));
  EXPECT_FALSE(buffer.push(ramp(10)));
  ImuSample broken = ramp(25);
  broken.accel_mps2.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(buffer.push(broken));
  broken.accel_mps2.y() = 1e9;
  EXPECT_FALSE(buffer.push(broken));
  EXPECT_TRUE(buffer.push(ramp(25)));
  EXPECT_EQ(buffer.counts().duplicate, 1);
  EXPECT_EQ(buffer.counts().backward, 1);
  EXPECT_EQ(buffer.counts().invalid, 2);
  EXPECT_EQ(buffer.counts().accepted, 6);
}

TEST(ImuBuffer, StampsStayForwardAfterExtraction) {
  ImuBuffer buffer = filled(0, 100);
  buffer.clear();
  EXPECT_FALSE(buffer.push(ramp(40)));
  EXPECT_EQ(buffer.counts().backward, 1);
}

TEST(ImuBuffer, HoldsTheNearestValueInAGapAndReportsIt) {
  ImuBuffer buffer = filled(0, 40);
  for (int t = 140; t <= 200; t += 5) buffer.push(ramp(t));
  const auto a = buffer.extract(ms(0), ms(60)), b = buffer.extract(ms(60), ms(120)), c = buffer.extract(ms(120), ms(180));
  ASSERT_TRUE(a && b && c);
  EXPECT_NEAR(a->samples.back().gyro_radps.x(), 0.040, 1e-12) << "40 ms is nearer to 60 than 140";
  EXPECT_NEAR(c->samples.front().gyro_radps.x(), 0.140, 1e-12);
  EXPECT_EQ(b->samples.size(), 2u);
  for (const auto& s : {a, b, c}) EXPECT_EQ(s->longest_gap.ns, 100'000'000);
  EXPECT_EQ(a->samples.back().gyro_radps, b->samples.front().gyro_radps);
}

TEST(ImuBuffer, AStartBeforeTheFirstReadingIsHeldAndReported) {
  ImuBuffer buffer = filled(100, 200);
  const auto segment = buffer.extract(ms(50), ms(150));
  ASSERT_TRUE(segment);
  EXPECT_EQ(segment->samples.front().t, ms(50));
  EXPECT_NEAR(segment->samples.front().gyro_radps.x(), 0.1, 1e-12);
  EXPECT_EQ(segment->longest_gap.ns, 50'000'000);
}

TEST(ImuBuffer, EndOfDataGivesWhatThereIs) {
  ImuBuffer buffer = filled(0, 40);
  const ImuSegment segment = buffer.extract_now(ms(10), ms(100));
  EXPECT_EQ(segment.samples.back().t, ms(100));
  EXPECT_NEAR(segment.samples.back().gyro_radps.x(), 0.04, 1e-12);
  EXPECT_EQ(segment.longest_gap.ns, 60'000'000);
  EXPECT_TRUE(ImuBuffer().extract_now(ms(0), ms(10)).empty());
}

TEST(ImuBuffer, MemoryIsBounded) {
  ImuBufferOptions options;
  options.capacity = 100;
  ImuBuffer buffer(options);
  for (int k = 0; k < 1000; ++k) buffer.push(ramp(5.0 * k));
  EXPECT_LE(buffer.size(), 100);
  EXPECT_EQ(buffer.size() + buffer.counts().overflow, 1000);
}

TEST(ImuBuffer, DropsWhatNoLaterSegmentNeeds) {
  ImuBuffer buffer = filled(0, 1000);
  buffer.extract(ms(0), ms(902));
  EXPECT_EQ(buffer.size(), 21);  // 900 .. 1000
}

}  // namespace
}  // namespace fbvins
