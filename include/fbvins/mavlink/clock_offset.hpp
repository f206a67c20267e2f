// SPDX-License-Identifier: Apache-2.0
// The offset of another machine's clock to this one's, from requests and answers (TIMESYNC).
//
//   offset.add(asked, their_time, answered);   // each answer
//   if (offset.known()) stamp = host_time + offset.value();
#pragma once

#include <deque>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// The other machine's time is taken as that of the middle between request and answer. Queues only add to the round trip, so
/// the offset is the median of the half of the newest answers with the shorter round trips.
class ClockOffset {
 public:
  /// `asked` and `answered` are times of this machine's clock, `theirs` of the other's; a time that no clock can have is ignored.
  void add(Time asked, Time theirs, Time answered);
  bool known() const { return answers_.size() >= kEnough; }
  /// Theirs less ours; only where known().
  Duration value() const { return value_; }
  /// Median of the newest answers; only where known().
  Duration round_trip() const;
  /// The newest answers contradict the value: the other clock may have begun anew.
  bool in_doubt() const { return !outliers_.empty(); }
  /// How often the other clock jumped, as it does when that machine restarts.
  int jumps() const { return jumps_; }

 private:
  struct Answer {
    Duration offset, round_trip;
  };
  static constexpr std::size_t kEnough = 8, kKept = 32, kJumpAnswers = 3;
  static constexpr Duration kLongestRoundTrip{200'000'000}, kJump{30'000'000};

  bool jumped(const Answer& answer) const;
  std::deque<Answer> answers_, outliers_;
  Duration value_;
  int jumps_ = 0;
};

}  // namespace fbvins
