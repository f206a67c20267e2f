// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_peer.hpp"

#include <algorithm>

namespace fbvins {
namespace {

constexpr Duration kQuestionEvery{100'000'000}, kSilence{3'000'000'000};
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
  questions_.erase(asked);
}

std::optional<TimesyncMessage> MavlinkPeer::question(Time now) {
  if (!is_heard(now) || !is_due(now, kQuestionEvery, next_question_)) return std::nullopt;
  questions_.push_back(now);
  if (questions_.size() > kOpenQuestions) questions_.pop_front();
  return TimesyncMessage{0, now.ns};
}

}  // namespace fbvins
