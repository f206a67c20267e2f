// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/clock_guard.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// A stamp is ahead of any possible arrival if it is this much less late, against this machine's clock, than any of the last
/// seconds.
constexpr double kAhead_s = 0.2;
/// Readings that merely arrive out of order go back by less.
constexpr double kBack_s = 0.1;
/// A jump is established by this many events that do not fit, over this time at least, whose stamps keep this machine's pace
/// to a share of that time and some jitter: longer than late data take to arrive in one block.
constexpr int kFewestMisfits = 3;
constexpr double kShortestMisfit_s = 0.25, kPaceShare = 0.2, kPaceJitter_s = 0.05;
/// Camera and IMU share a clock: two jumps that agree within these are the same one.
constexpr double kSameLeap_s = 0.05, kSameLeapWithin_s = 5;
constexpr double kWindow_s = 5;

}  // namespace

double ClockGuard::lateness_s(Time t, Time host) const {
  return (host - *first_host_).seconds() - (t - *first_).seconds() / rate_;
}
double ClockGuard::shortest_lateness_s() const { return std::min(current_s_, previous_s_); }

std::optional<Time> ClockGuard::mend(Stream stream, Time raw, Time host) {
  if (!first_) {
    first_ = raw;
    first_host_ = window_start_ = host;
  }
  State& s = states_[stream];
  if (!fits(s, raw + s.correction, host) || continues(s.misfits, raw, host)) {
    if (!go_on_as_a_clock(s.misfits, raw, host)) return std::nullopt;
    const Duration before = s.correction;
    s.correction = correction_after_leap(stream, raw, host);
    s.correction_before = before;
    s.leapt_host = host;
    ++leaps_;
  }
  s.misfits = {};
  const Time t = raw + s.correction;
  learn(s, t, host);
  return t;
}

bool ClockGuard::fits(const State& s, Time t, Time host) const {
  if (s.newest && (t - *s.newest).seconds() < -kBack_s) return false;
  // In seconds of the host's clock, so that the speed of a replay does not matter.
  return lateness_s(t, host) >= shortest_lateness_s() - kAhead_s || !std::isfinite(shortest_lateness_s());
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
/// correction, where that has jumped just now by about the same; or the correction of before, where the clock jumped back.
Duration ClockGuard::correction_after_leap(Stream stream, Time raw, Time host) const {
  const State &s = states_[stream], &other = states_[1 - stream];
  Duration own = s.correction;
  if (s.newest) {
    const double passed_s = (host - *s.newest_host).seconds() * rate_;
    const double period_s = s.period.median().value_or(Duration::from_seconds(std::max(passed_s, 1e-3))).seconds();
    const double steps = std::max(1.0, std::round(passed_s / period_s));
    own = *s.newest + Duration::from_seconds(steps * period_s) - raw;
  } else {
    own = *first_ + Duration::from_seconds(((host - *first_host_).seconds() - shortest_lateness_s()) * rate_) - raw;
  }
  const bool other_leapt = (host - other.leapt_host).seconds() < kSameLeapWithin_s;
  const auto about = [&](Duration d) { return std::abs((own - d).seconds()) < kSameLeap_s; };
  if (other_leapt && about(other.correction)) return other.correction;
  return about(s.correction_before) ? s.correction_before : own;
}

void ClockGuard::learn(State& s, Time t, Time host) {
  if (s.newest) s.period.add(t - *s.newest);
  if (!s.newest || t > *s.newest) s.newest = t;
  s.newest_host = host;
  if ((host - window_start_).seconds() > kWindow_s) {
    previous_s_ = current_s_;
    current_s_ = std::numeric_limits<double>::infinity();
    window_start_ = host;
  }
  current_s_ = std::min(current_s_, lateness_s(t, host));
}

Time ClockGuard::host_of(Time t) const {
  if (!first_) return {};
  const double since_first_s = (t - *first_).seconds() / rate_;
  return *first_host_ + Duration::from_seconds(since_first_s + shortest_lateness_s());
}

}  // namespace fbvins
