// SPDX-License-Identifier: Apache-2.0
// Detects jumps of the sensors' clock against this machine's, and corrects them. When a clock jumps (a device restarts, a driver
// sets the time), stamps are shifted so that they continue where they were. A stamp far before the newest one, or ahead of any
// possible arrival, does not fit. Events that do not fit are a jump only if they go on for a while at the clock's own pace, with
// none between them that fits; otherwise they are late, or their stamps wrong, and the clock is left alone. Data that are
// merely late by some constant, bunched or missing fit. After a clock was set back its stamps say nothing of the time that has
// passed: they are continued by this machine's clock, to a period, and the event reports it, once for both streams. A stream
// begins with the first two stamps that are in step, and a stamp that is earlier than its stream has been delivered so far counts
// when two more are.
//
//   if (auto event = guard.correct(ClockGuard::camera, frame.t, host_now))   // event->t is frame.t as long as no clock jumps
//     Time shutter = guard.host_of(event->t);                            // when that was on this machine's clock
//
// Threads: one owner.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "fbvins/core/sample_period.hpp"

namespace fbvins {

class ClockGuard {
 public:
  enum Stream { imu, camera };

  /// clock_rate: seconds of the sensors' clock in one second of this machine's.
  explicit ClockGuard(double clock_rate) : rate_(clock_rate) {}

  struct Event {
    Time t;
    int held_back =
        0;  ///< so many events of the stream that were refused just before it are good, with the stamps of `corrected`
    bool other_too = false;  ///< and so is the last one of the other stream, which had not begun
    Duration set_back{};     ///< more than 0: the clock was set back by so much, and these events are the first ones since
  };
  /// The stamp of an event that arrived at `host`, on the sensors' clock as it was before any jump. Nothing where it does not
  /// fit: the event is of no use, unless the next ones say so.
  std::optional<Event> correct(Stream stream, Time raw, Time host);
  /// An earlier stamp of this stream, with the correction of today.
  Time corrected(Stream stream, Time raw) const { return raw + states_[stream].correction; }
  /// Converts a time of the (corrected) sensors' clock to this machine's. The offset is that of the event of the last seconds
  /// that was delivered fastest: the shortest delay of the transport is not observable and counts as zero.
  Time host_of(Time t) const;
  int jumps() const { return jumps_; }

 private:
  /// As it came.
  struct Arrival {
    Time raw, host;
  };
  /// Of the last five to ten seconds, because clocks drift.
  class ShortestLateness {
   public:
    void add(double lateness_s, Time host);
    double value_s() const { return std::min(current_s_, previous_s_); }

   private:
    double current_s_ = std::numeric_limits<double>::infinity(), previous_s_ = std::numeric_limits<double>::infinity();
    std::optional<Time> window_start_;
  };
  /// Events in a row that do not fit.
  struct Misfits {
    int count = 0;
    Time first, first_host, newest;
  };
  struct State {
    Duration correction, correction_before;  ///< corrected = raw + correction; before the last jump
    std::optional<Time> newest, newest_host;
    Time jumped_host{std::numeric_limits<std::int64_t>::min() / 2};
    SamplePeriod period;
    ShortestLateness lateness;
    std::optional<Arrival> unconfirmed;  ///< the last one, before the stream has begun
    Misfits misfits;
    int early = 0;  ///< in a row
  };

  std::optional<Event> begin(Stream stream, Time raw, Time host);
  bool in_step(const Arrival& a, const Arrival& b) const;
  bool is_early(const State& s, Time t, Time host) const;
  bool fits(const State& s, Time t, Time host) const;
  bool continues(const Misfits& misfits, Time raw, Time host) const;
  bool go_on_as_a_clock(Misfits& misfits, Time raw, Time host) const;
  struct Jump {
    Duration correction;
    bool known;  ///< a counter's wrap, the clock of before, or the other stream's jump
  };
  Jump jump_of(Stream stream, Time raw, Time host) const;
  void learn(State& s, Time t, Time host);
  double lateness_s(Time t, Time host) const;
  double shortest_lateness_s() const;

  double rate_;
  std::array<State, 2> states_;
  std::optional<Arrival> first_;  ///< that counts
  int jumps_ = 0;
};

}  // namespace fbvins
