// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/recorded_aiding.hpp"

#include <algorithm>
#include <utility>

#include "fbvins/io/ros_messages.hpp"

namespace fbvins {

bool RecordedAiding::take(const McapMessage& message) {
  if (message.channel->topic == "/tf_static")
    for (const auto& [frame, T_BS] : read_mountings(message.data)) mounted_.insert_or_assign(frame, T_BS);
  if (!is_own_aiding_topic(message.channel->topic)) return true;
  std::string type = message.channel->schema_name;
  if (const std::size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  if (!is_aiding_type(type)) return true;
  std::optional<AidingMessage> read = aiding_of(message.data, Encoding::cdr, type);
  if (!read) return false;
  messages_.push_back(*std::move(read));
  return true;
}

std::vector<AidingSample> RecordedAiding::readings() const {
  std::vector<AidingSample> out;
  for (const AidingMessage& message : messages_) {
    const auto at = mounted_.find(message.frame);
    if (!mounting_of(message.reading)) out.push_back(message.reading);
    else if (at != mounted_.end()) out.push_back(mounted(message.reading, at->second));
  }
  std::ranges::stable_sort(out, {}, [](const AidingSample& r) { return stamp_of(r); });
  return out;
}

}  // namespace fbvins
