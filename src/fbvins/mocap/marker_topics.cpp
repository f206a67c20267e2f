// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <map>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/mcap_reader.hpp"
#include "fbvins/io/ros_messages.hpp"
#include "fbvins/mocap/motion_capture.hpp"

namespace fbvins {
namespace {

constexpr std::string_view kPose = "geometry_msgs/msg/PoseStamped", kOdometry = "nav_msgs/msg/Odometry";

struct Topic {
  std::vector<MarkerPose> poses;  ///< in recorded order
  RowCounts counts;
};

void take(const McapMessage& message, const std::string& file, Topic& topic) {
  ++topic.counts.rows;
  const auto pose = message.channel->schema_name == kPose ? read_pose(message.data) : read_odometry(message.data);
  const bool finite = pose && pose->p.allFinite() && pose->q.coeffs().allFinite();
  if (finite && std::abs(pose->q.norm() - 1) < 0.02) {
    topic.poses.push_back({pose->t, {pose->q.normalized(), pose->p}});
    return;
  }
  ++(pose && !finite ? topic.counts.not_finite : topic.counts.malformed);
  if (topic.counts.first_bad.empty()) topic.counts.first_bad = fmt::format("{}: byte {}: this is no pose", file, message.offset);
}

MarkerTrack in_order(const Topic& topic, RowCounts& counts) {
  std::vector<Time> stamps;
  for (const MarkerPose& pose : topic.poses) stamps.push_back(pose.t);
  const std::vector<bool> keep = longest_increasing(stamps);
  MarkerTrack track;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (keep[i]) track.push_back(topic.poses[i]);
    else ++(!track.empty() && track.back().t == stamps[i] ? counts.duplicates : counts.backwards);
  }
  return track;
}

}  // namespace

Result<MotionCapture> read_marker_topics(std::shared_ptr<const ByteSource> bytes, const std::string& file) {
  auto reader = McapReader::open(std::move(bytes), file);
  if (!reader) return reader.error();
  std::map<std::string, Topic> topics;
  while (const auto message = reader->next())
    if (message->channel->schema_name == kPose || message->channel->schema_name == kOdometry)
      take(*message, file, topics[message->channel->topic]);
  if (topics.empty()) {
    const std::string damage = reader->damage().first.empty() ? "" : fmt::format(" ({})", reader->damage().first);
    return Error{ErrorCode::not_found, fmt::format("{}: there is no topic of PoseStamped or Odometry in it{}", file, damage)};
  }
  MotionCapture out{"MCAP", {}, {}};
  for (const auto& [name, topic] : topics) {
    RowCounts& counts = out.counts;
    counts.rows += topic.counts.rows;
    counts.malformed += topic.counts.malformed;
    counts.not_finite += topic.counts.not_finite;
    if (counts.first_bad.empty()) counts.first_bad = topic.counts.first_bad;
    out.bodies.push_back({name, in_order(topic, counts), 0});
  }
  return out;
}

}  // namespace fbvins
