// SPDX-License-Identifier: Apache-2.0
// A flight controller's IMU as a sensor: the messages to send to it, and its readings on this machine's clock. No threads, ports
// or clocks of its own: time is an argument.
//
//   MavlinkImu imu;
//   for (const ImuSample& sample : imu.receive(bytes, now)) input.push(sample);
//   for (const auto& frame : imu.tick(now)) link.send(frame);
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fbvins/live/mavlink_peer.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Rate-limited clock offset: its estimates jitter by more than the intervals between readings may.
class SteadyOffset {
 public:
  /// `wanted`: the newest estimate.
  Duration at(Time now, Duration wanted);

 private:
  Duration value_;
  Time at_{};
  bool begun_ = false;
};

/// Readings come from HIGHRES_IMU, or from SCALED_IMU where the other does not come. B has the flight controller's axes, x
/// forward, y right, z down. No reading is returned before the clock offset is known (TIMESYNC).
class MavlinkImu {
 public:
  using Frames = std::vector<std::vector<std::uint8_t>>;

  /// Readings in these bytes; stamps on CLOCK_MONOTONIC, ascending.
  std::vector<ImuSample> receive(std::span<const std::uint8_t> bytes, Time now);
  /// Frames to send: heartbeats, TIMESYNC requests, the request for readings at kRate_hz.
  Frames tick(Time now);
  /// To be called when the port was reopened.
  void restart();

  const MavlinkPeer& peer() const { return peer_; }
  /// Readings that were dropped: stamps that cannot be right, as after a restart of the flight controller, or not finite.
  std::int64_t refused() const { return refused_; }

  static constexpr double kRate_hz = 200;

 private:
  void take(const MavlinkMessage& message, Time now, std::vector<ImuSample>& out);
  void take(const ImuSample& theirs, Time now, std::vector<ImuSample>& out);
  void say(const MavlinkMessage& message, Frames& out);

  MavlinkPeer peer_{0};
  MavlinkDecoder decoder_;
  SteadyOffset offset_;
  Time next_heartbeat_{}, next_request_{}, last_highres_{}, last_reading_{};
  Time newest_{};
  int requests_ = 0;
  std::uint8_t sequence_ = 0;
  std::int64_t refused_ = 0;
};

}  // namespace fbvins
