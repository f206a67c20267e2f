// SPDX-License-Identifier: Apache-2.0
// What is sent to a flight controller and when, without threads, ports or clocks of its own: time is an argument.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/live/mavlink_peer.hpp"
#include "fbvins/live/mavlink_sink.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

/// Times are of this machine's CLOCK_MONOTONIC. Each call returns the frames to send, in order.
///
/// Clocks: a flight controller estimates the offset of our clock by TIMESYNC requests, and shifts our stamps by it. Our stamps
/// are on its clock already, so its requests are answered in its own time, once that is known: the offset that it estimates
/// is zero.
class MavlinkSession {
 public:
  using Frames = std::vector<std::vector<std::uint8_t>>;

  explicit MavlinkSession(const MavlinkOptions& options);

  Frames take(const LivePose& pose);
  Frames take(const LiveStatus& status, Time now);
  Frames receive(std::span<const std::uint8_t> bytes, Time now);
  /// What is due: heartbeats, TIMESYNC requests, a change of health.
  Frames tick(Time now);
  /// To be called when the port was reopened: drops a half-read frame, and sends the health again.
  void restart();

  bool flight_controller_heard(Time now) const { return peer_.is_heard(now); }
  const ClockOffset& clock() const { return peer_.clock(); }
  std::int64_t poses() const { return poses_; }
  std::int64_t frames_received() const { return decoder_.counts().frames + decoder_.counts().skipped; }

 private:
  void receive(const MavlinkFrame& frame, Time now, Frames& out);
  void say(const MavlinkMessage& message, Frames& out);
  HeartbeatMessage heartbeat() const;
  std::uint64_t stamp_usec(Time host_t) const;

  MavlinkOptions options_;
  VehicleFrames frames_;
  MavlinkDecoder decoder_;
  MavlinkPeer peer_;
  std::uint8_t sequence_ = 0;
  std::optional<Health> health_;  // of the newest status
  std::optional<Health> told_health_;
  Time next_heartbeat_{}, next_text_{}, next_pose_{};
  std::int64_t poses_ = 0;
};

}  // namespace fbvins
