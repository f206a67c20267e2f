// SPDX-License-Identifier: Apache-2.0
// Golden frames are pymavlink's; tests/mavlink compares with it on random values.
#include "fbvins/mavlink/wire.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "fbvins/mavlink/payload.hpp"

namespace fbvins {
namespace wire_test {

using Bytes = std::vector<std::uint8_t>;

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

Bytes from_hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
  return bytes;
}

Bytes payload(const MavlinkMessage& message) {
  return std::visit(
      [](auto fields) {
        PayloadWriter writer;
        fields.wire(writer);
        return writer.bytes();
      },
      message);
}

const Bytes kMavlink1Heartbeat = from_hex("fe090901010004030201020c51040329d4");
const Bytes kAttitude = from_hex("fd1c00000d01c51e000064000000cdcccc3dcdcc4c3e9a99993e00000000000000000000003fd703");

std::vector<MavlinkMessage> one_of_each() {
  OdometryMessage odometry;
  odometry.time_usec = 1'000'000;
  odometry.x = 1, odometry.y = 2, odometry.z = -3, odometry.vx = 0.5F, odometry.yawspeed = 0.25F;
  odometry.pose_covariance[0] = 0.01F, odometry.velocity_covariance[0] = 0.04F;
  odometry.reset_counter = 2, odometry.quality = 100;
  VisionPositionMessage position;
  position.usec = 5, position.x = 1, position.y = 2, position.z = 3;
  position.roll = 0.1F, position.pitch = 0.2F, position.yaw = 0.3F;
  VisionSpeedMessage speed;
  speed.usec = 5, speed.x = 1, speed.y = 2, speed.z = 3, speed.reset_counter = 3;
  speed.covariance = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  return {HeartbeatMessage{},
          TimesyncMessage{0, 1'234'567'890'123},
          status_text(MavSeverity::warning, "VIO degraded: no_images"),
          odometry,
          position,
          speed};
}

Bytes stream_of_each() {
  Bytes stream;
  std::uint8_t sequence = 0;
  for (const MavlinkMessage& message : one_of_each()) {
    const Bytes frame = encode_mavlink(message, {}, sequence++);
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  return stream;
}

TEST(MavlinkWire, FramesAreThoseOfPymavlink) {
  const auto messages = one_of_each();
  const std::string zeros32(32, '0'), zeros80(80, '0');
  const std::vector<std::string> golden = {
      "fd0900000701c50000000000000012080004035d56",
      "fd0e00000801c56f00000000000000000000cb04fb711f0199a5",
      "fd1800000901c5fd00000456494f2064656772616465643a206e6f5f696d61676573c1e8",
      "fde900000a01c54b010040420f00000000000000803f00000040000040c00000803f0000000000000000000000000000003f" + zeros32 +
          "0000803e0ad7233c" + zeros80 + zeros80 + "0ad7233d" + zeros80 + zeros80 + "140c020364f734",
      "fd2000000b01c566000005000000000000000000803f0000004000004040cdcccc3dcdcc4c3e9a99993ea01e",
      "fd3900000c01c567000005000000000000000000803f00000040000040400000803f0000000000000000000000000000803f00000000000000000000"
      "00000000803f03605a"};
  for (std::size_t i = 0; i < messages.size(); ++i)
    EXPECT_EQ(hex(encode_mavlink(messages[i], {}, static_cast<std::uint8_t>(7 + i))), golden[i]);
}

TEST(MavlinkWire, WhatIsWrittenIsReadInAnyPieces) {
  const Bytes stream = stream_of_each();
  const auto sent = one_of_each();
  for (std::size_t piece = 1; piece < 40; ++piece) {
    MavlinkDecoder decoder;
    std::vector<MavlinkFrame> got;
    for (std::size_t at = 0; at < stream.size(); at += piece)
      for (auto& frame : decoder.push(std::span(stream).subspan(at, std::min(piece, stream.size() - at)))) got.push_back(frame);
    ASSERT_EQ(got.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      EXPECT_EQ(payload(got[i].message), payload(sent[i]));
      EXPECT_EQ(got[i].sequence, i);
      EXPECT_EQ(got[i].from, MavlinkAddress{});
    }
    EXPECT_EQ(decoder.counts().noise_bytes, 0);
  }
}

TEST(MavlinkWire, TheFirstVersionIsReadToo) {
  const auto frames = MavlinkDecoder().push(kMavlink1Heartbeat);
  ASSERT_EQ(frames.size(), 1u);
  const auto& beat = std::get<HeartbeatMessage>(frames[0].message);
  EXPECT_EQ(beat.custom_mode, 0x01020304u);
  EXPECT_EQ(beat.autopilot, 12);
  EXPECT_EQ(frames[0].from, (MavlinkAddress{1, 1}));
}

TEST(MavlinkWire, AForeignMessageIsSkippedAndCounted) {
  Bytes stream = kAttitude;
  stream.insert(stream.end(), kMavlink1Heartbeat.begin(), kMavlink1Heartbeat.end());
  MavlinkDecoder decoder;
  EXPECT_EQ(decoder.push(stream).size(), 1u);
  EXPECT_EQ(decoder.counts().skipped, 1);
  EXPECT_EQ(decoder.counts().noise_bytes, 0);
}

TEST(MavlinkWire, ASignedFrameIsReadToItsEnd) {
  Bytes frame = encode_mavlink(HeartbeatMessage{}, {}, 1);
  frame[2] = 1;  // the flag is part of the checksum
  frame.resize(frame.size() - 2);
  std::uint16_t crc = 0xffff;
  const auto add = [&crc](std::uint8_t byte) {
    std::uint8_t x = static_cast<std::uint8_t>(byte ^ (crc & 0xff));
    x = static_cast<std::uint8_t>(x ^ (x << 4));
    crc = static_cast<std::uint16_t>((crc >> 8) ^ (x << 8) ^ (x << 3) ^ (x >> 4));
  };
  for (std::size_t i = 1; i < frame.size(); ++i) add(frame[i]);
  add(HeartbeatMessage::kCrcExtra);
  frame.push_back(static_cast<std::uint8_t>(crc)), frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  frame.insert(frame.end(), 13, 0xfd);  // a signature that looks like the beginning of frames
  frame.insert(frame.end(), kMavlink1Heartbeat.begin(), kMavlink1Heartbeat.end());
  MavlinkDecoder decoder;
  EXPECT_EQ(decoder.push(frame).size(), 2u);
  EXPECT_EQ(decoder.counts().noise_bytes, 0);
}

TEST(MavlinkWire, AFlippedBitLosesItsFrameAlone) {
  const Bytes stream = stream_of_each();
  for (std::size_t bit = 0; bit < 8 * stream.size(); bit += 7) {
    Bytes broken = stream;
    broken[bit / 8] = static_cast<std::uint8_t>(broken[bit / 8] ^ 1u << bit % 8);
    broken.insert(broken.end(), stream.begin(), stream.end());
    const std::size_t got = MavlinkDecoder().push(broken).size();
    // A bit of the number may turn it into one of another message, whose checksum cannot be judged; nothing more is lost.
    EXPECT_GE(got, 2 * one_of_each().size() - 2) << bit;
    EXPECT_LE(got, 2 * one_of_each().size() - 1) << bit;
  }
}

TEST(MavlinkWire, AfterAnyNoiseGoodFramesAreFoundAgain) {
  Rng rng(11);
  const Bytes stream = stream_of_each();
  for (int round = 0; round < 300; ++round) {
    MavlinkDecoder decoder;
    Bytes noise(rng.below(400));
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(rng.below(4) == 0 ? 0xfd + rng.below(2) : rng.below(256));
    decoder.push(noise);
    // The longest frame that noise can announce has 280 bytes: after those every frame is found.
    for (int i = 0; i < 2; ++i) decoder.push(stream);
    EXPECT_EQ(decoder.push(stream).size(), one_of_each().size());
  }
}

TEST(MavlinkWire, CutAndPastedStreamsAreAnsweredAndNothingIsMadeUp) {
  Rng rng(12);
  const Bytes stream = stream_of_each();
  for (int round = 0; round < 2000; ++round) {
    Bytes broken = stream;
    for (std::uint32_t changes = 1 + rng.below(6); changes > 0; --changes) {
      const auto at = broken.begin() + rng.below(static_cast<std::uint32_t>(broken.size()));
      const auto length = std::min<std::ptrdiff_t>(rng.below(20), broken.end() - at);
      if (rng.below(2) == 0) broken.erase(at, at + length);
      else broken.insert(at, stream.begin(), stream.begin() + length);
    }
    MavlinkDecoder decoder;
    for (const MavlinkFrame& frame : decoder.push(broken)) {
      ASSERT_LT(frame.sequence, one_of_each().size());
      EXPECT_EQ(payload(frame.message), payload(one_of_each()[frame.sequence]));
    }
  }
}

}  // namespace wire_test
}  // namespace fbvins
