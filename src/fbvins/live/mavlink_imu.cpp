// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_imu.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fbvins {
namespace {

constexpr Duration kRequestEvery{1'000'000'000}, kQuiet{1'000'000'000};
/// Stamps further ahead of their arrival, or further behind, are of a clock that is not known yet. The limit behind is larger:
/// on a busy machine readings wait in the port, and are still good.
constexpr Duration kFarthestAhead{500'000'000}, kLatest{2'000'000'000};
/// Largest rate at which the offset follows its estimate, s/s; for differences beyond kJump it jumps.
constexpr double kRamp = 1e-3;
constexpr Duration kJump{20'000'000};
constexpr double kStandardGravity_mps2 = 9.80665;
constexpr MavlinkAddress kUs{1, 197};
/// After this many unanswered requests for HIGHRES_IMU, SCALED_IMU is requested as well.
constexpr int kRequestsUnanswered = 3;

/// Numbers on the wire are any 64 bits; a larger one is no clock's, and does not fit nanoseconds.
constexpr std::uint64_t kLatestClock_usec = 3'800'000'000'000'000;

Vec3 vector(const std::array<float, 3>& v) { return Vec3(v[0], v[1], v[2]); }
Vec3 thousandths(const std::array<std::int16_t, 3>& v) { return 1e-3 * Vec3(v[0], v[1], v[2]); }

/// MAV_CMD_SET_MESSAGE_INTERVAL; parameters: the message's id, and microseconds.
constexpr std::uint16_t kSetMessageInterval = 511;

CommandMessage interval_request(std::uint32_t message, const MavlinkAddress& to) {
  CommandMessage command;
  command.command = kSetMessageInterval;
  command.params = {static_cast<float>(message), static_cast<float>(1e6 / MavlinkImu::kRate_hz)};
  command.target_system = to.system, command.target_component = to.component;
  return command;
}

}  // namespace

Duration SteadyOffset::at(Time now, Duration wanted) {
  const Duration off = wanted - value_;
  if (!begun_ || std::abs(off.ns) > kJump.ns) {
    value_ = wanted;
  } else {
    const auto most = static_cast<std::int64_t>(kRamp * static_cast<double>(std::max<std::int64_t>((now - at_).ns, 0)));
    value_ = value_ + Duration{std::clamp(off.ns, -most, most)};
  }
  begun_ = true;
  at_ = now;
  return value_;
}

void MavlinkImu::say(const MavlinkMessage& message, Frames& out) { out.push_back(encode_mavlink(message, kUs, sequence_++)); }

void MavlinkImu::restart() {
  decoder_.restart();
  peer_.forget_questions();
}

MavlinkImu::Frames MavlinkImu::tick(Time now) {
  Frames out;
  if (is_due(now, kHeartbeatEvery, next_heartbeat_)) say(HeartbeatMessage{}, out);
  if (!peer_.is_heard(now)) return out;
  if (const auto question = peer_.question(now)) say(*question, out);
  if (now - last_reading_ > kQuiet && is_due(now, kRequestEvery, next_request_)) {
    say(interval_request(HighresImuMessage::kId, *peer_.address()), out);
    if (++requests_ > kRequestsUnanswered) say(interval_request(ScaledImuMessage::kId, *peer_.address()), out);
  }
  return out;
}

std::vector<ImuSample> MavlinkImu::receive(std::span<const std::uint8_t> bytes, Time now) {
  std::vector<ImuSample> samples;
  for (const MavlinkFrame& frame : decoder_.push(bytes)) {
    peer_.hear(frame, now);
    if (peer_.address() && frame.from == *peer_.address()) take(frame.message, now, samples);
  }
  return samples;
}

void MavlinkImu::take(const MavlinkMessage& message, Time now, std::vector<ImuSample>& out) {
  if (const auto* m = std::get_if<HighresImuMessage>(&message)) {
    if (m->id != 0 || (m->fields_updated & m->kAccelAndGyro) != m->kAccelAndGyro) return;
    if (m->time_usec > kLatestClock_usec) return void(++refused_);
    last_highres_ = now;
    take({Time{static_cast<std::int64_t>(m->time_usec) * 1000}, vector(m->gyro), vector(m->acc)}, now, out);
  } else if (const auto* coarse = std::get_if<ScaledImuMessage>(&message)) {
    if (now - last_highres_ < kQuiet) return;
    const Duration offset = peer_.clock().known() ? peer_.clock().value() : Duration{};
    take({unwrapped(coarse->time_boot_ms, now + offset), thousandths(coarse->gyro),
          kStandardGravity_mps2 * thousandths(coarse->acc)},
         now, out);
  }
}

void MavlinkImu::take(const ImuSample& theirs, Time now, std::vector<ImuSample>& out) {
  last_reading_ = now;
  requests_ = 0;
  if (!peer_.clock().known()) return;
  ImuSample sample = theirs;
  sample.t = theirs.t - offset_.at(now, peer_.clock().value());
  const bool sound = sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite();
  const Duration late = now - sample.t;
  if (!sound || late > kLatest || -late.ns > kFarthestAhead.ns || sample.t <= newest_) {
    ++refused_;
    return;
  }
  newest_ = sample.t;
  out.push_back(sample);
}

}  // namespace fbvins
