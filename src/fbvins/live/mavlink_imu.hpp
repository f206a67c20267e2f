// SPDX-License-Identifier: Apache-2.0
// A flight controller's IMU as a sensor of ours: what is asked of it, and its readings on this machine's clock. No threads, ports
// or clocks of its own: time comes in as an argument.
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

/// The other clock's offset as a ramp: estimates of it jitter by more than the time between two readings may.
class SteadyOffset {
 public:
  /// `wanted`: the newest estimate.
  Duration at(Time now, Duration wanted);

 private:
  Duration value_;
  Time at_{};
  bool begun_ = false;
};

/// Readings are HIGHRES_IMU's; SCALED_IMU's where the other does not come. B has the flight controller's axes, x forward,
/// y right, z down. Nothing leaves before the clocks are known to each other (TIMESYNC).
class MavlinkImu {
 public:
  using Frames = std::vector<std::vector<std::uint8_t>>;

  /// Stamps are of CLOCK_MONOTONIC, ascending.
  std::vector<ImuSample> receive(std::span<const std::uint8_t> bytes, Time now);
  /// Frames to send: heartbeats, questions for the time, the wish for readings at kRate_hz.
  Frames tick(Time now);
  /// The port was opened anew.
  void restart();

  const MavlinkPeer& peer() const { return peer_; }
  /// Readings whose stamps could not be right: the clock of a flight controller that restarted is learnt anew.
  std::int64_t refused() const { return refused_; }

  static constexpr double kRate_hz = 200;

 private:
  void take(const MavlinkMessage& message, Time now, std::vector<ImuSample>& out);
  void take(const ImuSample& theirs, Time now, std::vector<ImuSample>& out);
  void say(const MavlinkMessage& message, Frames& out);

  MavlinkPeer peer_{0};
  MavlinkDecoder decoder_;
  SteadyOffset offset_;
  Time next_heartbeat_{}, next_wish_{}, last_highres_{}, last_reading_{};
  Time newest_{};
  int wishes_ = 0;
  std::uint8_t sequence_ = 0;
  std::int64_t refused_ = 0;
};

}  // namespace fbvins
