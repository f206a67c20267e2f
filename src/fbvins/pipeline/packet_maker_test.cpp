// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/packet_maker.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace fbvins {
namespace packet_maker_test {

constexpr std::int64_t kMs = 1'000'000;

ImuSample reading(std::int64_t ms) {
  ImuSample sample;
  sample.t = Time{ms * kMs};
  sample.accel_mps2 = Vec3(0, 0, 9.81);
  return sample;
}

StereoFrame image(std::int64_t ms) { return {Time{ms * kMs}}; }

std::vector<SensorPacket> drain(PacketMaker& maker, bool flush = false) {
  std::vector<SensorPacket> packets;
  while (auto packet = maker.next(flush)) packets.push_back(std::move(*packet));
  return packets;
}

PacketMaker make(double time_offset_s = 0) { return PacketMaker(ImuNoise{}, Duration::from_seconds(time_offset_s)); }

TEST(PacketMaker, AnImageWaitsForTheReadingsUpToItsStamp) {
  PacketMaker maker = make();
  for (int ms = 0; ms <= 45; ms += 5) maker.push(reading(ms));
  maker.push(image(10));
  maker.push(image(50));
  ASSERT_EQ(drain(maker).size(), 1u);
  maker.push(reading(50));
  const auto packets = drain(maker);
  ASSERT_EQ(packets.size(), 1u);
  EXPECT_EQ(packets[0].id.value, 1);
  ASSERT_FALSE(packets[0].imu.empty());
  EXPECT_EQ(packets[0].imu.samples.front().t.ns, 10 * kMs);
  EXPECT_EQ(packets[0].imu.samples.back().t.ns, 50 * kMs);
  EXPECT_EQ(packets[0].imu.samples.size(), 9u);
}

TEST(PacketMaker, ASilentImuDoesNotBlockTheImages) {
  PacketMaker maker = make();
  for (int ms = 0; ms <= 600; ms += 50) maker.push(image(ms));
  const auto packets = drain(maker);
  // Images older than the newest by more than 0.25 s have waited long enough: 0 to 300 ms.
  ASSERT_EQ(packets.size(), 7u);
  for (const SensorPacket& packet : packets) EXPECT_TRUE(packet.imu.empty());
}

TEST(PacketMaker, ReadingsThatComeBackAreUsedForTheNextImages) {
  PacketMaker maker = make();
  for (int ms = 0; ms <= 600; ms += 50) maker.push(image(ms));
  (void)drain(maker);
  for (int ms = 500; ms <= 700; ms += 5) maker.push(reading(ms));
  const auto packets = drain(maker);
  ASSERT_EQ(packets.size(), 6u);
  EXPECT_EQ(packets.back().frame.t.ns, 600 * kMs);
  EXPECT_EQ(packets.back().imu.samples.size(), 11u);
}

TEST(PacketMaker, ImagesThatAreNotNewerAreSkippedAndCounted) {
  PacketMaker maker = make();
  for (int ms : {0, 50, 50, 20, 100}) maker.push(image(ms));
  const auto packets = drain(maker, true);
  ASSERT_EQ(packets.size(), 3u);
  EXPECT_EQ(packets[2].frame.t.ns, 100 * kMs);
  EXPECT_EQ(packets[2].id.value, 2);
  EXPECT_EQ(maker.counts().images, 3);
  EXPECT_EQ(maker.counts().images_backward, 2);
}

TEST(PacketMaker, FlushGivesImagesThatStillWaitForReadings) {
  PacketMaker maker = make();
  for (int ms = 0; ms <= 70; ms += 5) maker.push(reading(ms));
  for (int ms : {0, 50, 100}) maker.push(image(ms));
  EXPECT_EQ(drain(maker).size(), 2u);
  const auto rest = drain(maker, true);
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_EQ(rest[0].frame.t.ns, 100 * kMs);
  EXPECT_TRUE(drain(maker, true).empty());
}

TEST(PacketMaker, ARangeGoesWithTheFirstImageThatIsNotOlder) {
  PacketMaker maker = make();
  for (int ms = 0; ms <= 300; ms += 5) maker.push(reading(ms));
  const auto range = [&](std::int64_t ms) {
    RangeSample r;
    r.t = Time{ms * kMs};
    maker.push(r);
  };
  for (const int ms : {40, 50, 60, 1'000'000, 90}) range(ms);  // one of them from the far future
  for (const int ms : {0, 50, 100}) maker.push(image(ms));
  const auto packets = drain(maker);
  ASSERT_EQ(packets.size(), 3u);
  EXPECT_TRUE(packets[0].aiding.empty());
  ASSERT_EQ(packets[1].aiding.size(), 2u);
  EXPECT_EQ(stamp_of(packets[1].aiding[1]).ns, 50 * kMs);
  ASSERT_EQ(packets[2].aiding.size(), 2u);
  range(80), range(99);  // late, but not too late
  maker.push(image(240));
  const auto later = drain(maker);
  ASSERT_EQ(later.size(), 1u);
  ASSERT_EQ(later[0].aiding.size(), 1u) << "the other one is too old";
  EXPECT_EQ(stamp_of(later[0].aiding[0]).ns, 99 * kMs);
}

TEST(PacketMaker, TheTimeOffsetMovesTheReadingsAndNotTheImage) {
  PacketMaker maker = make(0.010);
  for (int ms = 0; ms <= 100; ms += 5) {
    ImuSample sample = reading(ms);
    sample.gyro_radps.x() = 1e-3 * ms;
    maker.push(sample);
  }
  maker.push(image(20));
  maker.push(image(70));
  const auto packets = drain(maker);
  ASSERT_EQ(packets.size(), 2u);
  EXPECT_EQ(packets[1].frame.t.ns, 70 * kMs);
  EXPECT_EQ(packets[1].imu.samples.front().t.ns, 20 * kMs);
  EXPECT_NEAR(packets[1].imu.samples.front().gyro_radps.x(), 0.030, 1e-12) << "stamped 30 ms by the IMU";
  EXPECT_NEAR(packets[1].imu.samples.back().gyro_radps.x(), 0.080, 1e-12);
}

}  // namespace packet_maker_test
}  // namespace fbvins
