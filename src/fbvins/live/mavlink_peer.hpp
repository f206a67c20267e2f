// SPDX-License-Identifier: Apache-2.0
// The flight controller at the other end of a MAVLink connection: whether it is heard, and its clock offset.
//
//   peer.hear(frame, now);                                       // every frame that comes
//   if (auto question = peer.question(now)) send(*question);     // ten times a second while it is heard
//   if (peer.clock_is_sure(now)) theirs = ours + peer.clock().value();
#pragma once

#include <deque>
#include <optional>

#include "fbvins/mavlink/clock_offset.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {

/// How often a peer is told that this end lives.
inline constexpr Duration kHeartbeatEvery{1'000'000'000};

/// Times are of this machine's CLOCK_MONOTONIC.
class MavlinkPeer {
 public:
  /// `system_id`: the vehicle's number; 0: whichever flight controller is heard first.
  explicit MavlinkPeer(int system_id) : system_id_(system_id) {}

  void hear(const MavlinkFrame& frame, Time now);
  bool is_heard(Time now) const;
  Time heard_at() const { return heard_at_; }
  /// None before its first heartbeat.
  const std::optional<MavlinkAddress>& address() const { return address_; }
  /// The offset is known and the flight controller has confirmed it lately: it has not restarted since.
  bool clock_is_sure(Time now) const;
  /// A TIMESYNC request, when one is due: more often until the clock is known.
  std::optional<TimesyncMessage> question(Time now);
  /// To be called when the port was reopened: answers to older requests are ignored.
  void forget_questions() { questions_.clear(); }
  const ClockOffset& clock() const { return clock_; }

 private:
  void answer(const TimesyncMessage& message, const MavlinkAddress& from, Time now);

  int system_id_;
  std::optional<MavlinkAddress> address_;
  Time heard_at_{}, answered_at_{}, next_question_{};
  std::deque<Time> questions_;
  ClockOffset clock_;
};

/// The time nearest to `expected` of a counter of milliseconds that begins anew after 49.7 days.
Time unwrapped(std::uint32_t counter_ms, Time expected);
/// True once in each period; missed periods are not made up for.
bool is_due(Time now, Duration period, Time& next);

}  // namespace fbvins
