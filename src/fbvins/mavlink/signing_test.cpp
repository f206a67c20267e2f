// SPDX-License-Identifier: Apache-2.0
// tests/mavlink compares signatures with pymavlink's; the golden frame is pymavlink's, too.
#include "fbvins/mavlink/signing.hpp"

#include <gtest/gtest.h>

#include "fbvins/mavlink/wire.hpp"

namespace fbvins {
namespace signing_test {

using Bytes = std::vector<std::uint8_t>;

MavlinkKey key_of(std::uint8_t byte) {
  MavlinkKey key;
  key.fill(byte);
  return key;
}

class MavlinkSigning : public testing::Test {
 protected:
  void SetUp() override {
    if (!parse_mavlink_key(std::string(64, '0'))) GTEST_SKIP() << "built without nettle";
  }
  std::size_t read(const Bytes& bytes) { return decoder.push(bytes).size(); }

  MavlinkSigner ours{key_of(7), 1'000'000'000}, theirs{key_of(7), 1'000'000'000};
  MavlinkDecoder decoder{&theirs};
};

TEST_F(MavlinkSigning, AFrameOfTheKeyIsTakenOnce) {
  const Bytes frame = encode_mavlink(HeartbeatMessage{}, {}, 1, &ours);
  EXPECT_EQ(read(frame), 1u);
  EXPECT_EQ(read(frame), 0u) << "repeated";
  EXPECT_EQ(decoder.counts().unsigned_frames, 1);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {}, 2, &ours)), 1u);
  EXPECT_EQ(decoder.counts().noise_bytes, 0);
}

TEST_F(MavlinkSigning, WithoutTheKeyNothingIsTaken) {
  MavlinkSigner other(key_of(8), 2'000'000'000);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {}, 1, &other)), 0u);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {}, 1)), 0u);
  EXPECT_EQ(read(Bytes{0xfe, 9, 9, 1, 1, 0, 4, 3, 2, 1, 2, 12, 0x51, 4, 3, 0x29, 0xd4}), 0u) << "MAVLink 1";
  EXPECT_EQ(decoder.counts().unsigned_frames, 3);
  EXPECT_EQ(theirs.time(), 1'000'000'000u) << "a forged time changes nothing";
}

TEST_F(MavlinkSigning, AnyChangedBitIsNoticed) {
  const Bytes frame = encode_mavlink(TimesyncMessage{5, 6}, {}, 1, &ours);
  for (std::size_t bit = 8 * (frame.size() - MavlinkSigner::kBytes); bit < 8 * frame.size(); ++bit) {
    Bytes changed = frame;
    changed[bit / 8] = static_cast<std::uint8_t>(changed[bit / 8] ^ 1u << bit % 8);
    EXPECT_EQ(read(changed), 0u) << bit;
  }
  EXPECT_EQ(read(frame), 1u);
}

TEST_F(MavlinkSigning, ANewSenderIsAtMostAMinuteBehind) {
  MavlinkSigner late(key_of(7), 1'000'000'000 - 5'000'000), old(key_of(7), 1'000'000'000 - 7'000'000);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {3, 1}, 1, &old)), 0u);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {3, 1}, 1, &late)), 1u);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {3, 1}, 1, &old)), 0u);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {4, 1}, 1, &old)), 0u) << "each sender by itself";
}

TEST_F(MavlinkSigning, OurTimeIsNeverBehindTheirs) {
  MavlinkSigner ahead(key_of(7), 3'000'000'000);
  EXPECT_EQ(read(encode_mavlink(HeartbeatMessage{}, {}, 1, &ahead)), 1u);
  EXPECT_EQ(theirs.time(), 3'000'000'001u);
  theirs.advance(5);
  EXPECT_EQ(theirs.time(), 3'000'000'001u);
}

TEST_F(MavlinkSigning, AKeyIsDigitsOrBytes) {
  const std::string digits = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F";
  const auto key = parse_mavlink_key(digits + "\n");
  ASSERT_TRUE(key);
  EXPECT_EQ((*key)[31], 0x1f);
  EXPECT_EQ((*parse_mavlink_key(std::string(32, 'x')))[5], 'x');
  for (const std::string& bad : {std::string(), std::string(63, '0'), std::string(65, '0'), digits.substr(0, 62) + "0g"})
    EXPECT_FALSE(parse_mavlink_key(bad)) << bad;
}

TEST(MavlinkSigningTime, CountsTensOfMicrosecondsSince2015) {
  EXPECT_EQ(mavlink_signing_time(Time{1'420'070'401'000'000'000}), 100'000u);
  EXPECT_EQ(mavlink_signing_time(Time{}), 0u);
}

}  // namespace signing_test
}  // namespace fbvins
