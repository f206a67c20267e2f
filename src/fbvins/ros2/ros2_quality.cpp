// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_quality.hpp"

#include <fmt/format.h>

#include <charconv>
#include <sstream>
#include <string_view>

namespace fbvins {
namespace {

constexpr int kLongestQueue = 10'000;

Error wrong(std::string_view what) {
  return {ErrorCode::invalid_argument,
          fmt::format("live.ros2.qos: '{}': TOPIC=SETTING/SETTING...; settings are reliable, best_effort, transient_local, "
                      "volatile and the queue's length from 1 to {}",
                      what, kLongestQueue)};
}

bool set(Ros2QualityWish& wish, std::string_view setting) {
  if (setting == "reliable") wish.reliable = true;
  else if (setting == "best_effort") wish.reliable = false;
  else if (setting == "transient_local") wish.latched = true;
  else if (setting == "volatile") wish.latched = false;
  else {
    int depth = 0;
    const auto [end, error] = std::from_chars(setting.data(), setting.data() + setting.size(), depth);
    if (error != std::errc() || end != setting.data() + setting.size() || depth < 1 || depth > kLongestQueue) return false;
    wish.depth = depth;
  }
  return true;
}

}  // namespace

Result<Ros2QualityWishes> parse_ros2_qos(const std::string& text) {
  Ros2QualityWishes wishes;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto equals = part.find('=');
    const std::string topic = part.substr(0, equals);
    if (equals == std::string::npos || topic.empty() || topic.find_first_of(" \t") != std::string::npos) return wrong(part);
    Ros2QualityWish& wish = wishes[topic];
    std::istringstream settings(part.substr(equals + 1));
    std::string setting;
    if (settings.str().empty() || settings.str().back() == '/') return wrong(part);
    while (std::getline(settings, setting, '/'))
      if (!set(wish, setting)) return wrong(part);
  }
  return wishes;
}

}  // namespace fbvins
