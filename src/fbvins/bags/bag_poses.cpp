// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_poses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <vector>

#include "fbvins/bags/bag_messages.hpp"
#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr const char* kTruthTopic = "/ground_truth";

bool is_pose(const std::string& type) {
  return type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/PoseWithCovarianceStamped" ||
         type == "geometry_msgs/TransformStamped" || type == "nav_msgs/Odometry";
}

Result<std::string> choose(const std::map<std::string, Trajectory<W>>& topics, const std::string& named) {
  if (topics.contains(named)) return named;
  if (named.empty() && topics.size() == 1) return topics.begin()->first;
  if (named.empty() && topics.contains(kTruthTopic)) return std::string(kTruthTopic);
  std::vector<std::string> names;
  for (const auto& [name, poses] : topics) names.push_back(printable(name));
  if (names.empty()) return Error{ErrorCode::not_found, "holds no poses (PoseStamped, TransformStamped or Odometry)"};
  return Error{ErrorCode::not_found,
               named.empty() ? fmt::format("has poses on {}: say which with --topic", fmt::join(names, ", "))
                             : fmt::format("there are no poses on '{}'; there are on {}", named, fmt::join(names, ", "))};
}

}  // namespace

Result<Trajectory<W>> read_bag_poses(const std::string& path, const std::string& topic) {
  auto bag = open_bag(path);
  if (!bag) return bag.error();
  std::map<std::string, Trajectory<W>> topics;
  while (const std::optional<BagMessage> message = (*bag)->next()) {
    const BagTopic& about = (*bag)->topics()[message->topic];
    if (!is_pose(about.type)) continue;
    if (const auto point = pose_of(message->data, about.encoding, about.type))
      topics[about.name].push_back({point->t, point->T_WB});
  }
  const Result<std::string> chosen = choose(topics, topic);
  if (!chosen) return Error{chosen.error().code, fmt::format("{}: {}", path, chosen.error().message)};
  Trajectory<W> poses = std::move(topics[*chosen]);
  std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  poses.erase(std::unique(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.t == b.t; }), poses.end());
  return poses;
}

}  // namespace fbvins
