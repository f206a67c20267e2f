// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/clock_offset.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

/// Times on the wire are any 64 bits. No clock counts from before zero or to beyond the year 2090, and so differences of
/// offsets stay within 64 bits.
constexpr Time kLatestClock{3'800'000'000'000'000'000};

}  // namespace

/// Whether the offset differs by more than a delay on one of the two ways alone could explain.
bool ClockOffset::jumped(const Answer& answer) const {
  const std::int64_t off = std::abs((answer.offset - value_).ns);
  return off > answer.round_trip.ns / 2 + kJump.ns;
}

void ClockOffset::add(Time asked, Time theirs, Time answered) {
  if (theirs.ns < 0 || theirs > kLatestClock) return;
  Answer answer;
  answer.round_trip = answered - asked;
  if (answer.round_trip.ns < 0 || answer.round_trip > kLongestRoundTrip) return;
  answer.offset = theirs - Time{asked.ns + answer.round_trip.ns / 2};

  if (!answers_.empty() && jumped(answer)) {
    outliers_.push_back(answer);
    if (outliers_.size() < kJumpAnswers) return;
    answers_ = std::exchange(outliers_, {});
    ++jumps_;
  } else {
    outliers_.clear();
    answers_.push_back(answer);
    if (answers_.size() > kKept) answers_.pop_front();
  }

  std::vector<Answer> quick(answers_.begin(), answers_.end());
  std::sort(quick.begin(), quick.end(), [](const Answer& a, const Answer& b) { return a.round_trip < b.round_trip; });
  quick.resize((quick.size() + 1) / 2);
  const auto middle = quick.begin() + static_cast<std::ptrdiff_t>(quick.size() / 2);
  std::nth_element(quick.begin(), middle, quick.end(), [](const Answer& a, const Answer& b) { return a.offset < b.offset; });
  value_ = middle->offset;
}

Duration ClockOffset::round_trip() const {
  std::vector<std::int64_t> all;
  for (const Answer& answer : answers_) all.push_back(answer.round_trip.ns);
  return {median(all)};
}

}  // namespace fbvins
