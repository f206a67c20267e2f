// SPDX-License-Identifier: Apache-2.0
// What is sent to a flight controller and when, without threads, ports or clocks of its own: time is an argument.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/mavlink_aiding.hpp"
#include "fbvins/live/mavlink_peer.hpp"
#include "fbvins/live/mavlink_sink.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

/// The option `origin`: three numbers with commas between, degrees and metres; none where it is empty. An error says what it is
/// not.
Result<std::optional<GlobalOriginMessage>> parse_mavlink_origin(const std::string& text);

/// Times are of this machine's CLOCK_MONOTONIC. Each call returns the frames to send, in order.
///
/// Clocks: no pose is sent unless the offset to the flight controller's clock is sure. PX4 takes stamps that are ahead of its
/// clock, and then ignores the right ones, which are older. A flight controller estimates the offset of our clock by TIMESYNC
/// requests, and shifts our stamps by it. Our stamps are on its clock already, so its requests are answered in its own time, once
/// that is known: the offset that it estimates is zero.
class MavlinkSession {
 public:
  using Frames = std::vector<std::vector<std::uint8_t>>;

  /// With a signer everything that is sent is signed, and what is received unsigned is ignored.
  explicit MavlinkSession(const MavlinkOptions& options, std::unique_ptr<MavlinkSigner> signer = nullptr);

  /// Nothing where the flight controller's clock is not sure (MavlinkClock).
  Frames take(const LivePose& pose);
  Frames take(const LiveStatus& status, Time now);
  /// Where M is, for poses in it (LocalOrigin::map).
  void take(const MapUpdate& update) { frames_.take(update); }
  Frames receive(std::span<const std::uint8_t> bytes, Time now);
  /// Of the flight controller's sensors that the options name, since the last call, on this machine's clock.
  std::vector<AidingSample> take_readings() { return std::exchange(readings_, {}); }
  /// What is due: heartbeats, TIMESYNC requests, a change of health.
  Frames tick(Time now);
  /// To be called when the port was reopened: drops a half-read frame, and sends the health again.
  void restart();

  bool flight_controller_heard(Time now) const { return peer_.is_heard(now); }
  /// When the flight controller's last heartbeat came.
  Time heard_at() const { return peer_.heard_at(); }
  const ClockOffset& clock() const { return peer_.clock(); }
  bool clock_is_sure(Time now) const { return peer_.clock_is_sure(now); }
  /// Null where frames are not signed.
  MavlinkSigner* signer() { return signer_.get(); }
  std::int64_t frames_refused() const { return decoder_.counts().unsigned_frames; }
  /// Stamps are on the clock that the options name.
  bool may_send_poses(Time now) const;
  /// Why no poses are sent, in one sentence; empty: they are, or have not been missing for three seconds.
  std::string problem(Time now) const;
  std::int64_t poses() const { return poses_; }
  /// Poses that were due while the clock was not sure.
  std::int64_t poses_withheld() const { return withheld_; }
  std::int64_t frames_received() const { return decoder_.counts().frames + decoder_.counts().skipped; }

 private:
  void receive(const MavlinkFrame& frame, Time now, Frames& out);
  void say(const MavlinkMessage& message, Frames& out);
  void say_pose(const LivePose& pose, std::uint64_t t_usec, Frames& out);
  OdometryMessage odometry_for_px4(const LivePose& pose, const std::optional<VehicleState>& state, std::uint64_t t_usec) const;
  std::optional<OdometryMessage> odometry_for_ardupilot(const std::optional<VehicleState>& state, std::uint64_t t_usec);
  void say_origin(Time now, Frames& out);
  HeartbeatMessage heartbeat() const;
  Time their_time(Time host_t) const;
  std::uint64_t stamp_usec(Time host_t) const;

  MavlinkOptions options_;
  std::unique_ptr<MavlinkSigner> signer_;
  VehicleFrames frames_;
  MavlinkDecoder decoder_;
  MavlinkAiding aiding_;
  std::vector<AidingSample> readings_;
  MavlinkPeer peer_;
  std::uint8_t sequence_ = 0;
  std::optional<Health> health_;  // of the newest status
  std::optional<Health> told_health_;
  bool had_pose_ = false;
  std::optional<OdometryMessage> last_;        // with a pose, in the dialect ardupilot
  std::optional<GlobalOriginMessage> origin_;  // that the flight controller is to be told
  bool origin_is_known_ = false;               // as it has said
  Time next_heartbeat_{}, next_text_{}, next_pose_{}, next_origin_{};
  std::optional<Time> unsure_since_;
  std::int64_t poses_ = 0, withheld_ = 0;
};

}  // namespace fbvins
