// SPDX-License-Identifier: Apache-2.0
// Detects jumps of the sensors' clock against this machine's, and corrects them. When a clock jumps (a device restarts, a driver
// sets the time), stamps are shifted so that they continue where they were. Data that are merely late, bunched or missing are
// left alone: a jump shows by a stamp before the newest one, or ahead of any possible arrival.
//
//   Time t = guard.mend(ClockGuard::camera, frame.t, host_now);   // frame.t itself as long as no clock jumps
//   Time shutter = guard.host_of(t);                              // when that was on this machine's clock
//
// Threads: one owner.
#pragma once

#include <array>
#include <limits>
#include <optional>

#include "fbvins/live/sample_period.hpp"

namespace fbvins {

class ClockGuard {
 public:
  enum Stream { imu, camera };

  /// clock_rate: seconds of the sensors' clock in one second of this machine's.
  explicit ClockGuard(double clock_rate) : rate_(clock_rate) {}

  /// The stamp of an event that arrived at `host`, on the sensors' clock as it was before any jump.
  Time mend(Stream stream, Time raw, Time host);
  /// Converts a time of the (corrected) sensors' clock to this machine's. The offset is that of the event of the last seconds
  /// that was delivered fastest: the shortest delay of the transport is not observable and counts as zero.
  Time host_of(Time t) const;
  int leaps() const { return leaps_; }

 private:
  struct State {
    Duration correction;  ///< mended = raw + correction
    std::optional<Time> newest, newest_host;
    Time leapt_host{std::numeric_limits<std::int64_t>::min() / 2};
    SamplePeriod period;
  };

  bool leapt(const State& s, Time t, Time host) const;
  Duration correction_after_leap(Stream stream, Time raw, Time host) const;
  void learn(State& s, Time t, Time host);
  double lateness_s(Time t, Time host) const;
  double shortest_lateness_s() const;

  double rate_;
  std::array<State, 2> states_;
  std::optional<Time> first_, first_host_;
  /// Shortest lateness in the current window so far and in the one before: a sliding minimum, as the clocks drift.
  double current_s_ = std::numeric_limits<double>::infinity(), previous_s_ = std::numeric_limits<double>::infinity();
  Time window_start_;
  int leaps_ = 0;
};

}  // namespace fbvins
