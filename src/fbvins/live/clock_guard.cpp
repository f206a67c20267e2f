// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/clock_guard.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace fbvins {
namespace {

/// A stamp is ahead of any possible arrival if it is this much less late, against this machine's clock, than any of the last
/// seconds.
constexpr double kAhead_s = 0.2;
/// Data that merely arrive out of order are less behind where their stream was due; this is the same for all rates, so that a
/// jump is seen in both streams or in neither.
constexpr double kBack_s = 0.1;
/// A jump is established by this many events that do not fit, over this time at least, whose stamps keep this machine's pace
/// to a share of that time and some jitter: longer than late data take to arrive in one block.
constexpr int kFewestMisfits = 3;
constexpr double kShortestMisfit_s = 0.25, kPaceShare = 0.2, kPaceJitter_s = 0.05;
/// Camera and IMU share a clock: two jumps that agree within these are the same one.
constexpr double kSameJump_s = 0.05, kSameJumpWithin_s = 5;
constexpr double kWindow_s = 5;
/// Of a counter of 32 bits of microseconds.
constexpr Duration kWrap{(std::int64_t{1} << 32u) * 1000};
/// Two stamps are in step if they are this much apart, at most, from what passed between them.
constexpr double kInStep_s = 0.1;
/// A stamp is early if it is less late than any of its stream in the last seconds by more than this, and this many periods: data
/// that come in a block are less late by a period each.
constexpr double kEarly_s = 0.03, kEarly_periods = 1.5;

}  // namespace

void ClockGuard::ShortestLateness::add(double lateness_s, Time host) {
  if (!window_start_) window_start_ = host;
  if ((host - *window_start_).seconds() > kWindow_s) {
    previous_s_ = current_s_;
    current_s_ = std::numeric_limits<double>::infinity();
    window_start_ = host;
  }
  current_s_ = std::min(current_s_, lateness_s);
}

double ClockGuard::lateness_s(Time t, Time host) const {
  return (host - first_->host).seconds() - (t - first_->raw).seconds() / rate_;
}
double ClockGuard::shortest_lateness_s() const {
  return std::min(states_[imu].lateness.value_s(), states_[camera].lateness.value_s());
}

std::optional<ClockGuard::Event> ClockGuard::correct(Stream stream, Time raw, Time host) {
  State& s = states_[stream];
  if (!s.newest) return begin(stream, raw, host);
  int held_back = 0;
  Duration set_back{};
  if (!fits(s, raw + s.correction, host) || continues(s.misfits, raw, host)) {
    if (!go_on_as_a_clock(s.misfits, raw, host)) return std::nullopt;
    const Duration before = s.correction;
    const Jump jump = jump_of(stream, raw, host);
    s.correction = jump.correction;
    s.correction_before = before;
    if (!jump.known && s.correction > before) set_back = s.correction - before;
    s.jumped_host = host;
    ++jumps_;
    held_back = s.misfits.count - 1;
  } else if (is_early(s, raw + s.correction, host)) {
    if (++s.early < kFewestMisfits) return std::nullopt;
    held_back = s.early - 1;
  }
  s.misfits = {};
  s.early = 0;
  const Time t = raw + s.correction;
  learn(s, t, host);
  return Event{.t = t, .held_back = held_back, .set_back = set_back};
}

/// The first stamps may be wrong, too: a stream begins when one is in step with the one before, or with the other stream.
std::optional<ClockGuard::Event> ClockGuard::begin(Stream stream, Time raw, Time host) {
  State &s = states_[stream], &other = states_[1 - stream];
  const Arrival now{raw, host};
  const bool with_own = s.unconfirmed && in_step(*s.unconfirmed, now);
  const bool with_other = other.newest && in_step({*other.newest - other.correction, *other.newest_host}, now);
  const bool both_begin = !other.newest && other.unconfirmed && in_step(*other.unconfirmed, now);
  s.unconfirmed = now;
  if (!with_own && !with_other && !both_begin) return std::nullopt;
  if (with_other) s.correction = other.correction;
  if (!first_) first_ = now;
  if (both_begin) learn(other, other.unconfirmed->raw, other.unconfirmed->host);
  const Time t = raw + s.correction;
  learn(s, t, host);
  return Event{t, with_own ? 1 : 0, both_begin};
}

bool ClockGuard::in_step(const Arrival& a, const Arrival& b) const {
  return std::abs((b.host - a.host).seconds() - (b.raw - a.raw).seconds() / rate_) < kInStep_s;
}

bool ClockGuard::is_early(const State& s, Time t, Time host) const {
  const std::optional<Duration> period = s.period.median();
  return period && lateness_s(t, host) < s.lateness.value_s() - std::max(kEarly_s, kEarly_periods * period->seconds() / rate_);
}

bool ClockGuard::fits(const State& s, Time t, Time host) const {
  const double after_s = (t - *s.newest).seconds();
  if (after_s < 0 && after_s < s.period.median().value_or(Duration{}).seconds() - kBack_s) return false;
  // In seconds of the host's clock, so that the speed of a replay does not matter.
  return lateness_s(t, host) >= shortest_lateness_s() - kAhead_s;
}

/// After a jump back by a fraction of a second stamps pass the newest one of before while the jump is not yet established; what
/// fits has not the misfits' lateness.
bool ClockGuard::continues(const Misfits& misfits, Time raw, Time host) const {
  return misfits.count > 0 && raw > misfits.newest &&
         std::abs(lateness_s(raw, host) - lateness_s(misfits.first, misfits.first_host)) < kPaceJitter_s;
}

bool ClockGuard::go_on_as_a_clock(Misfits& misfits, Time raw, Time host) const {
  if (misfits.count == 0 || raw <= misfits.newest) misfits = {0, raw, host, raw};
  ++misfits.count;
  misfits.newest = raw;
  const double passed_s = (host - misfits.first_host).seconds(), stamped_s = (raw - misfits.first).seconds() / rate_;
  return misfits.count >= kFewestMisfits && passed_s >= kShortestMisfit_s &&
         std::abs(stamped_s - passed_s) < kPaceJitter_s + kPaceShare * passed_s;
}

/// Puts the stamp a whole number of periods after the stream's newest one, by the time that has passed; or the other stream's
/// correction, where that has jumped just now by about the same; or a counter's wrap; or the correction of before, where the
/// clock jumped back.
ClockGuard::Jump ClockGuard::jump_of(Stream stream, Time raw, Time host) const {
  const State &s = states_[stream], &other = states_[1 - stream];
  const double passed_s = (host - *s.newest_host).seconds() * rate_;
  const double period_s = s.period.median().value_or(Duration::from_seconds(std::max(passed_s, 1e-3))).seconds();
  const double steps = std::max(1.0, std::round(passed_s / period_s));
  const Duration own = *s.newest + Duration::from_seconds(steps * period_s) - raw;
  const bool other_jumped = (host - other.jumped_host).seconds() < kSameJumpWithin_s;
  const auto about = [&](Duration d) { return std::abs((own - d).seconds()) < kSameJump_s; };
  if (other_jumped && about(other.correction)) return {other.correction, true};
  if (const Duration wrapped = s.correction + kWrap; about(wrapped)) return {wrapped, true};
  return about(s.correction_before) ? Jump{s.correction_before, true} : Jump{own, false};
}

void ClockGuard::learn(State& s, Time t, Time host) {
  if (s.newest) s.period.add(t - *s.newest);
  if (!s.newest || t > *s.newest) s.newest = t;
  s.newest_host = host;
  s.lateness.add(lateness_s(t, host), host);
}

Time ClockGuard::host_of(Time t) const {
  if (!first_) return {};
  const double since_first_s = (t - first_->raw).seconds() / rate_;
  return first_->host + Duration::from_seconds(since_first_s + shortest_lateness_s());
}

}  // namespace fbvins
