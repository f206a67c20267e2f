// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_peer.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr Duration kQuestionEvery{100'000'000}, kFirstQuestionsEvery{20'000'000}, kSilence{3'000'000'000};
/// Without an answer for longer the flight controller may be restarting, with a clock that begins anew: that takes a board more
/// than two seconds.
constexpr Duration kClockStaysSure{2'000'000'000};
constexpr std::size_t kOpenQuestions = 16;

}  // namespace

bool is_due(Time now, Duration period, Time& next) {
  if (now < next) return false;
  next = next + period;
  if (next <= now) next = now + period;
  return true;
}

bool MavlinkPeer::is_heard(Time now) const { return address_ && now - heard_at_ < kSilence; }

void MavlinkPeer::hear(const MavlinkFrame& frame, Time now) {
  if (const auto* beat = std::get_if<HeartbeatMessage>(&frame.message)) {
    if (beat->autopilot == HeartbeatMessage::kNoAutopilot) return;
    if (system_id_ == 0) system_id_ = frame.from.system;
    if (frame.from.system != system_id_) return;
    if (is_heard(now) && frame.from != *address_) return;  // the first keeps its place until it is silent
    if (address_ && frame.from != *address_) clock_ = ClockOffset(), questions_.clear();
    address_ = frame.from;
    heard_at_ = now;
  } else if (const auto* sync = std::get_if<TimesyncMessage>(&frame.message)) {
    if (sync->tc1 != 0) answer(*sync, frame.from, now);
  }
}

/// Accepts one answer to each of our requests, from the flight controller only.
void MavlinkPeer::answer(const TimesyncMessage& message, const MavlinkAddress& from, Time now) {
  const auto asked = std::find(questions_.begin(), questions_.end(), Time{message.ts1});
  if (from != address_ || asked == questions_.end()) return;
  clock_.add(*asked, Time{message.tc1}, now);
  answered_at_ = now;
  questions_.erase(asked);
}

bool MavlinkPeer::clock_is_sure(Time now) const {
  return clock_.known() && !clock_.in_doubt() && now - answered_at_ < kClockStaysSure;
}

std::optional<TimesyncMessage> MavlinkPeer::question(Time now) {
  if (!is_heard(now)) return std::nullopt;
  if (!is_due(now, clock_.known() && !clock_.in_doubt() ? kQuestionEvery : kFirstQuestionsEvery, next_question_))
    return std::nullopt;
  questions_.push_back(now);
  if (questions_.size() > kOpenQuestions) questions_.pop_front();
  return TimesyncMessage{0, now.ns};
}

Time unwrapped(std::uint32_t counter_ms, Time expected) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  const std::int64_t expected_ms = expected.ns / kNsPerMs;
  const auto off_ms = static_cast<std::int32_t>(counter_ms - static_cast<std::uint32_t>(expected_ms));
  return Time{(expected_ms + off_ms) * kNsPerMs};
}

}  // namespace fbvins
