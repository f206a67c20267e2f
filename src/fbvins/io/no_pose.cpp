// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/no_pose.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace fbvins {

std::string no_pose_sentence(const std::map<std::string, int>& images_by_health) {
  int images = 0;
  for (const auto& [health, count] : images_by_health) images += count;
  if (images == 0) return "no pose, as there is no image";
  const auto most = std::ranges::max_element(images_by_health, {}, [](const auto& of) { return of.second; });
  const std::string share = most->second == images ? "all" : fmt::format("{:.0f} %", 100.0 * most->second / images);
  return fmt::format("no pose in any of {} images: health is {} in {} of them (docs/troubleshooting.md)", images, most->first,
                     share);
}

std::string few_good_sentence(const std::map<std::string, int>& images_by_health, int restarts) {
  int poses = 0, good = 0;
  const std::pair<const std::string, int>* most = nullptr;
  for (const auto& of : images_by_health) {
    if (of.first == "good") good = of.second;
    else if (of.first.starts_with("degraded") && (most == nullptr || of.second > most->second)) most = &of;
    if (of.first == "good" || of.first.starts_with("degraded")) poses += of.second;
  }
  if (most == nullptr || (2 * good >= poses && restarts == 0)) return {};
  if (2 * good >= poses)
    return fmt::format(
        "the pose was lost and found anew {}: health is {} in {} of {} images with a pose (docs/troubleshooting.md)",
        restarts == 1 ? "once" : fmt::format("{} times", restarts), most->first, most->second, poses);
  return fmt::format("only {} of {} poses are good: health is {} in {} of them (docs/troubleshooting.md)", good, poses,
                     most->first, most->second);
}

}  // namespace fbvins
