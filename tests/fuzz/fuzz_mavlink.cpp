// SPDX-License-Identifier: Apache-2.0
// A flight controller's bytes, as a fuzz target: the decoder with and without signing, its readings, its clock.
#include <algorithm>

#include "fbvins/live/mavlink_imu.hpp"
#include "fbvins/live/mavlink_session.hpp"
#include "fbvins/mavlink/payload.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/require.hpp"

namespace fbvins::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr Duration kStep{10'000'000};
constexpr Time kBegin{1'000'000'000};
constexpr MavlinkAddress kAutopilot{1, 1};
constexpr std::size_t kKinds = std::variant_size_v<MavlinkMessage>;

/// A message of this number with these bytes as its fields.
template <std::size_t I = 0>
MavlinkMessage message_of(std::size_t kind, std::span<const std::uint8_t> fields) {
  if constexpr (I < kKinds) {
    if (kind != I) return message_of<I + 1>(kind, fields);
    std::variant_alternative_t<I, MavlinkMessage> message;
    PayloadReader reader(fields);
    message.wire(reader);
    return message;
  }
  return HeartbeatMessage{};
}

/// The input is a row of packets: a byte for the kind, a byte for the size, and the content. A kind of a message becomes a frame
/// with a right checksum, which mutations would not give; another one goes to the decoder as it is.
Bytes packet_of(std::uint8_t kind, std::span<const std::uint8_t> content) {
  if (kind < kKinds) return encode_mavlink(message_of(kind, content), kAutopilot, 0);
  return {content.begin(), content.end()};
}

void append_packet(std::string& out, std::uint8_t kind, const Bytes& content) {
  out += static_cast<char>(kind);
  out += static_cast<char>(std::min<std::size_t>(content.size(), 255));
  out.append(content.begin(), content.end());
}

void append_message(std::string& out, const MavlinkMessage& message) {
  std::visit(
      [&](auto fields) {
        PayloadWriter writer;
        fields.wire(writer);
        append_packet(out, static_cast<std::uint8_t>(message.index()), writer.bytes());
      },
      message);
}

MavlinkOptions with_sensors() {
  MavlinkOptions options;
  options.sensors.range = options.sensors.flow = options.sensors.pressure = true;
  return options;
}

/// The companion, with the requirements that its answers fulfil.
struct Companion {
  MavlinkImu imu;
  MavlinkSession session{with_sensors()};
  MavlinkKey key{};
  MavlinkSigner signer{key, 0};
  MavlinkDecoder plain, wants_signed{&signer};
  Time now = kBegin, newest{};

  void hear(std::span<const std::uint8_t> packet) {
    for (const ImuSample& sample : imu.receive(packet, now)) {
      require(sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite() && sample.t > newest);
      newest = sample.t;
    }
    require_frames(session.receive(packet, now));
    for (const AidingSample& reading : session.take_readings()) require(impossible(reading).empty());
    LivePose pose;
    pose.host_t = now;
    pose.health = {HealthState::good, HealthReason::none};
    require_frames(session.take(pose));
    (void)session.problem(now);
    for (const MavlinkFrame& frame : plain.push(packet)) (void)encode_mavlink(frame.message, frame.from, frame.sequence);
    require(wants_signed.push(packet).empty());
  }
  void require_frames(const MavlinkSession::Frames& frames) {
    for (const Bytes& frame : frames) require(MavlinkDecoder().push(frame).size() == 1);
  }
  std::vector<TimesyncMessage> tick() {
    std::vector<TimesyncMessage> questions;
    require_frames(session.tick(now));
    for (const Bytes& frame : imu.tick(now))
      for (const MavlinkFrame& read : MavlinkDecoder().push(frame))
        if (const auto* sync = std::get_if<TimesyncMessage>(&read.message)) questions.push_back(*sync);
    return questions;
  }
};

}  // namespace

/// A flight controller that answers and sends readings, one whose counter of milliseconds begins anew, and frames as they are.
std::vector<std::string> mavlink_seeds() {
  std::vector<std::string> seeds;
  for (const std::int64_t ahead_ns : {std::int64_t{7'000'000'000}, std::int64_t{4'294'967'296'000'000} - 1'400'000'000}) {
    Companion companion;
    std::string seed;
    HeartbeatMessage beat;
    beat.autopilot = 12;
    for (int i = 0; i < 40; ++i) {
      std::string packets;
      if (i == 0) append_message(packets, beat);
      for (const TimesyncMessage& question : companion.tick())
        append_message(packets, TimesyncMessage{companion.now.ns + ahead_ns, question.ts1});
      const std::int64_t theirs_ns = companion.now.ns + ahead_ns;
      HighresImuMessage fine;
      fine.time_usec = static_cast<std::uint64_t>(theirs_ns / 1000), fine.acc = {0, 0, -9.8f}, fine.fields_updated = 0x3f;
      ScaledImuMessage coarse;
      coarse.time_boot_ms = static_cast<std::uint32_t>(theirs_ns / 1'000'000);
      DistanceSensorMessage distance;
      distance.time_boot_ms = coarse.time_boot_ms, distance.max_distance = 800, distance.current_distance = 150;
      append_message(packets, distance);
      OpticalFlowRadMessage flow;
      flow.time_usec = fine.time_usec, flow.integration_time_us = 20'000, flow.distance = 1.5f, flow.quality = 200;
      append_message(packets, flow);
      ScaledPressureMessage pressure;
      pressure.time_boot_ms = coarse.time_boot_ms, pressure.press_abs = 1010;
      append_message(packets, pressure);
      if (ahead_ns < 10'000'000'000) append_message(packets, fine);
      else append_message(packets, coarse);
      // The companion hears each packet at a time of its own, as in fuzz_mavlink.
      for (std::size_t at = 0; at + 2 <= packets.size(); at += 2 + static_cast<std::uint8_t>(packets[at + 1])) {
        const Bytes content(packets.begin() + static_cast<std::ptrdiff_t>(at) + 2,
                            packets.begin() + static_cast<std::ptrdiff_t>(at) + 2 + static_cast<std::uint8_t>(packets[at + 1]));
        companion.hear(packet_of(static_cast<std::uint8_t>(packets[at]), content));
      }
      companion.now = companion.now + kStep;
      append_packet(packets, kKinds, {});  // ends the step
      seed += packets;
    }
    seeds.push_back(seed);
  }
  std::string raw;
  HeartbeatMessage beat;
  beat.autopilot = 12;
  append_packet(raw, kKinds + 1, encode_mavlink(beat, kAutopilot, 1));
  append_packet(raw, kKinds + 1, encode_mavlink(OdometryMessage{}, kAutopilot, 2));
  MavlinkSigner signer(MavlinkKey{1}, 5);
  append_packet(raw, kKinds + 1, encode_mavlink(TimesyncMessage{0, 5}, kAutopilot, 3, &signer));
  seeds.push_back(raw);
  return seeds;
}

void fuzz_mavlink(std::string_view bytes) {
  Companion companion;
  companion.tick();
  for (std::size_t at = 0; at + 2 <= bytes.size();) {
    const auto kind = static_cast<std::uint8_t>(bytes[at]);
    const std::size_t size = std::min<std::size_t>(static_cast<std::uint8_t>(bytes[at + 1]), bytes.size() - at - 2);
    const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data()) + at + 2;
    at += 2 + size;
    if (kind == kKinds) {
      companion.now = companion.now + kStep;
      companion.tick();
    } else {
      companion.hear(packet_of(kind, {begin, size}));
    }
  }
}

}  // namespace fbvins::fuzz
