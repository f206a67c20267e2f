// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/clock_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include "fbvins/core/median.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

/// Between the last stamp before a step and the first one after it: long enough that nobody integrates over it.
constexpr Duration kGap{1'000'000'000};
/// Smaller steps are left to the order of rows.
constexpr Duration kLeastStep{100'000'000};
/// The pace of so many rows on both sides shows that neither is a single wrong row.
constexpr std::size_t kRows = 4;
/// Of the times that a step goes back to, at least this share is taken, unless rows merely came late.
constexpr double kTaken = 0.7;
/// Rows before a step that are looked at; steps of a clock that is one.
constexpr std::size_t kLooked = 20'000, kMostSteps = 100;
/// Streams of one clock step back by the same, but for their periods.
constexpr Duration kSameStep{100'000'000};

Duration usual_interval(const std::vector<Time>& stamps) {
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) intervals.push_back(stamps[i] - stamps[i - 1]);
  return intervals.empty() ? Duration{} : median(intervals);
}

/// From row `from` to before `to` the stamps go on, no interval beyond `longest`.
bool go_on(const std::vector<Time>& stamps, std::size_t from, std::size_t to, Duration longest) {
  for (std::size_t i = from + 1; i < to; ++i)
    if (stamps[i] <= stamps[i - 1] || stamps[i] - stamps[i - 1] > longest) return false;
  return true;
}

/// Whether the rows [part, i), of which those of the last minutes are looked at, have stamps where those from i on go again.
bool times_are_taken(const std::vector<Time>& stamps, std::size_t part, std::size_t i, Duration interval) {
  const std::size_t begin = std::max(part, i > kLooked ? i - kLooked : 0);
  const Time from = std::max(stamps[i], stamps[begin]), to = stamps[i - 1];
  const auto here = std::count_if(stamps.begin() + static_cast<std::ptrdiff_t>(begin),
                                  stamps.begin() + static_cast<std::ptrdiff_t>(i), [&](Time t) { return t >= from && t <= to; });
  return static_cast<double>(here) >= kTaken * (1 + static_cast<double>((to - from).ns) / static_cast<double>(interval.ns));
}

/// Whether the rows from i on leap ahead to where the stamps before were: a block that came late.
bool leap_ahead(const std::vector<Time>& stamps, std::size_t i, Duration longest) {
  std::size_t k = i + 1;
  while (k < stamps.size() && stamps[k] <= stamps[i - 1] && stamps[k] > stamps[k - 1]) ++k;
  return k < stamps.size() && stamps[k] > stamps[i - 1] && stamps[k] - stamps[k - 1] > longest;
}

std::size_t first_of_part(const StampStream& s, std::size_t k) { return k == 0 ? 0 : s.steps[k - 1]; }
std::size_t end_of_part(const StampStream& s, std::size_t k) { return k < s.steps.size() ? s.steps[k] : s.stamps.size(); }

/// As if the first stamp after it had come an interval after the last one before.
Duration step_back(const StampStream& s, std::size_t k) {
  return s.stamps[s.steps[k] - 1] - s.stamps[s.steps[k]] + usual_interval(s.stamps);
}

/// Whether the rows that go back were there before: they came twice.
bool are_repeats(const StampStream& s, std::size_t k) {
  const std::size_t step = s.steps[k];
  if (!s.same) return false;
  std::size_t at = first_of_part(s, k);
  for (std::size_t i = step; i < end_of_part(s, k + 1) && s.stamps[i] <= s.stamps[step - 1]; ++i) {
    while (at < step && s.stamps[at] < s.stamps[i]) ++at;
    if (at == step || s.stamps[at] != s.stamps[i] || !s.same(i, at)) return false;
  }
  return true;
}

void forget_repeats(StampStream& s) {
  std::vector<std::size_t> real;
  for (std::size_t k = 0; k < s.steps.size(); ++k)
    if (!are_repeats(s, k)) real.push_back(s.steps[k]);
  s.steps = std::move(real);
}

/// All step as often as the first one, by the same.
bool step_together(const std::vector<StampStream*>& streams) {
  const StampStream& first = *streams.front();
  return std::ranges::all_of(streams, [&](const StampStream* s) {
    if (s->steps.size() != first.steps.size()) return false;
    const Duration slack = kSameStep + usual_interval(s->stamps) + usual_interval(first.stamps);
    for (std::size_t k = 0; k < s->steps.size(); ++k)
      if (std::abs((step_back(*s, k) - step_back(first, k)).ns) > slack.ns) return false;
    return true;
  });
}

/// Each stamp of part k of all streams, shifted by the same.
void continue_part(const std::vector<StampStream*>& streams, std::size_t k, JoinedClock& out) {
  Time end{std::numeric_limits<std::int64_t>::min()}, begin{std::numeric_limits<std::int64_t>::max()};
  Duration back{};
  for (const StampStream* s : streams) {
    const std::size_t first = s->steps[k - 1];
    end = std::max(end, *std::max_element(s->stamps.begin() + static_cast<std::ptrdiff_t>(first_of_part(*s, k - 1)),
                                          s->stamps.begin() + static_cast<std::ptrdiff_t>(first)));
    begin = std::min(begin, *std::min_element(s->stamps.begin() + static_cast<std::ptrdiff_t>(first),
                                              s->stamps.begin() + static_cast<std::ptrdiff_t>(end_of_part(*s, k))));
    back = std::max(back, s->stamps[first - 1] - out.added[k - 1] - s->stamps[first] + usual_interval(s->stamps));
  }
  const Duration added = end + kGap - begin;
  for (StampStream* s : streams)
    for (std::size_t i = s->steps[k - 1]; i < end_of_part(*s, k); ++i) s->stamps[i] = s->stamps[i] + added;
  out.begins.push_back(end + Duration{kGap.ns / 2});
  out.added.push_back(added);
  out.said.push_back(
      fmt::format("the sensors' clock was set back by {:.3f} s after {} s, or the device started again: the estimate begins anew "
                  "there, {} s are added to the stamps that follow",
                  back.seconds(), format_seconds(end - out.added[k - 1]), format_seconds(Time{} + added)));
}

/// Nobody can tell how the clocks lie to one another after the step.
void leave_out_rest(const std::vector<StampStream*>& streams, JoinedClock& out) {
  std::string stepped, others;
  Duration back{};
  Time end{std::numeric_limits<std::int64_t>::max()};
  for (StampStream* s : streams) {
    std::string& names = s->steps.empty() ? others : stepped;
    names += (names.empty() ? "" : ", ") + s->name;
    if (s->steps.empty()) continue;
    back = std::max(back, step_back(*s, 0));
    s->kept = s->steps.front();
    end = std::min(end, s->stamps[s->kept - 1]);
  }
  for (StampStream* s : streams)
    if (s->steps.empty())
      s->kept = static_cast<std::size_t>(std::ranges::find_if(s->stamps, [&](Time t) { return t > end + kSameStep; }) -
                                         s->stamps.begin());
  out.said.push_back(fmt::format(
      "the stamps of {} step back by {:.3f} s{}: what comes after that cannot be put in time, and is left out", stepped,
      back.seconds(), others.empty() ? ", by different amounts or not equally often" : ", those of " + others + " do not"));
}

}  // namespace

int continue_wrapped(std::vector<Time>& stamps) {
  constexpr Duration kWrap{(std::int64_t{1} << 32u) * 1000}, kLongestGap{10'000'000'000};
  int wraps = 0;
  Duration ahead{};
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const Duration step = stamps[i] + ahead - stamps[i - 1];
    // Two rows on the other side, or the file's last: one row alone is damage.
    const bool goes_on = i + 1 == stamps.size() || std::abs((stamps[i + 1] - stamps[i]).ns) < kLongestGap.ns;
    if (step.ns < kLongestGap.ns - kWrap.ns && step.ns > -kWrap.ns && goes_on) ahead = ahead + kWrap, ++wraps;
    stamps[i] = stamps[i] + ahead;
  }
  return wraps;
}

std::vector<std::size_t> clock_steps(const std::vector<Time>& stamps) {
  std::vector<std::size_t> out;
  const Duration interval = usual_interval(stamps), longest{10 * interval.ns};
  if (interval.ns <= 0) return out;
  std::size_t part = 0;
  for (std::size_t i = kRows; i + kRows <= stamps.size(); ++i) {
    if (stamps[i] >= stamps[i - 1] || (stamps[i - 1] - stamps[i] + interval) < kLeastStep) continue;
    if (i < part + kRows || !go_on(stamps, i - kRows, i, longest) || !go_on(stamps, i, i + kRows, longest)) continue;
    if (!times_are_taken(stamps, part, i, interval) || leap_ahead(stamps, i, longest)) continue;
    if (out.size() == kMostSteps) return {};
    out.push_back(i);
    part = i;
  }
  return out;
}

JoinedClock join_clock(const std::vector<StampStream*>& given) {
  std::vector<StampStream*> streams;
  JoinedClock out;
  out.added.push_back({});
  for (StampStream* s : given) {
    if (const int wraps = continue_wrapped(s->stamps); wraps > 0) out.said.push_back(wrapped_sentence(s->name, wraps));
    s->steps = clock_steps(s->stamps);
    forget_repeats(*s);
    s->kept = s->stamps.size();
    if (!s->stamps.empty()) streams.push_back(s);
  }
  if (streams.empty()) return out;
  if (!step_together(streams)) return leave_out_rest(streams, out), out;
  for (std::size_t k = 1; k <= streams.front()->steps.size(); ++k) continue_part(streams, k, out);
  return out;
}

std::string wrapped_sentence(const std::string& name, int wraps) {
  return fmt::format("{}: a counter of 32 bits of microseconds began again at 0 ({} x): the stamps are continued", name, wraps);
}

}  // namespace fbvins
