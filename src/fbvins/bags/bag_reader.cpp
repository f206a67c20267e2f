// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_reader.hpp"

#include <algorithm>

namespace fbvins {

std::optional<BagMessage> BagReader::next() {
  while (std::optional<BagMessage> message = advance()) {
    if (!window_) return message;
    begun_.resize(topics_.size(), false);
    const bool is_first = !begun_[message->topic];
    begun_[message->topic] = true;
    if (is_in_window(message->log_time, message->log_time) || is_first || stays(topics_[message->topic])) return message;
  }
  return std::nullopt;
}

std::size_t BagReader::number_of(BagTopic topic) {
  const auto known = std::find(topics_.begin(), topics_.end(), topic);
  if (known != topics_.end()) return static_cast<std::size_t>(known - topics_.begin());
  topics_.push_back(std::move(topic));
  return topics_.size() - 1;
}

bool BagReader::can_leave_out(Time first, Time last, const std::vector<std::size_t>& topics) {
  if (!window_ || is_in_window(first, last)) return false;
  begun_.resize(topics_.size(), false);
  return std::all_of(topics.begin(), topics.end(), [&](std::size_t i) { return begun_[i] && !stays(topics_[i]); });
}

bool BagReader::is_in_window(Time first, Time last) {
  if (!origin_) origin_ = first;
  // As doubles: stamps of damaged files may lie further apart than nanoseconds in 64 bits reach.
  const auto since_origin_ns = [&](Time t) { return static_cast<double>(t.ns) - static_cast<double>(origin_->ns); };
  return since_origin_ns(last) >= static_cast<double>(window_->from.ns) &&
         since_origin_ns(first) < static_cast<double>(window_->to.ns);
}

}  // namespace fbvins
