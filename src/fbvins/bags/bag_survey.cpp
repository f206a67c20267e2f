// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

bool is_image(const std::string& type) { return type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage"; }

/// One over the median interval.
double rate_of(std::vector<Time> stamps) {
  std::sort(stamps.begin(), stamps.end());
  return measure_intervals(stamps).rate_hz;
}

/// What the first message of a topic tells about all of them. `unreadable`: the error, where all have it.
std::string first_of(const BagMessage& message, const BagTopic& about, std::string& unreadable) {
  if (about.type == "sensor_msgs/Imu") {
    MessageFields in(message.data, about.encoding);
    in.header();
    return in.ok() ? fmt::format("frame '{}'", printable(std::string(in.frame()))) : "";
  }
  if (!is_image(about.type)) return "";
  const bool compressed = about.type == "sensor_msgs/CompressedImage";
  const Result<Image> image = image_of(message.data, about.encoding, compressed);
  const std::string kind = compressed ? "compressed" : encoding_of(message.data, about.encoding);
  if (image) return fmt::format("{} x {} {}", image->width(), image->height(), kind);
  if (image.error().code == ErrorCode::unsupported)
    unreadable = image.error().message;  // an encoding; else it may be one that is damaged
  return image.error().message;
}

}  // namespace

BagSurvey survey_bag(BagReader& bag, const RecordingOptions& options) {
  BagSurvey out;
  out.format = bag.format();
  std::map<std::string, std::vector<Time>> stamps;
  std::map<std::string, TopicSurvey> topics;
  std::map<std::string, std::string> unreadable;
  const BagContents contents = read_contents(bag, [&](const BagMessage& message, const BagTopic& about) {
    TopicSurvey& topic = topics[about.name];
    if (topic.messages++ == 0)
      topic.name = printable(about.name), topic.type = printable(about.type),
      topic.first = first_of(message, about, unreadable[about.name]);
    stamps[about.name].push_back(message.log_time);
  });
  Time first{std::int64_t{1} << 62}, last{0};
  for (auto& [name, topic] : topics) {
    const auto [begin, end] = std::minmax_element(stamps[name].begin(), stamps[name].end());
    first = std::min(first, *begin), last = std::max(last, *end);
    topic.rate_hz = rate_of(stamps[name]);
    out.topics.push_back(topic);
  }
  if (!topics.empty()) out.duration_s = (last - first).seconds();
  const BagDamage& damage = bag.damage();
  if (damage.parts > 0) out.warnings.push_back(fmt::format("{} ({} parts of the file are left out)", damage.first, damage.parts));
  if (damage.ends_early) out.warnings.emplace_back("the bag was cut off; all that is whole is read");
  auto chosen = choose_topics(contents, options.topics, {.depth = true});
  if (!chosen) {
    out.question = chosen.error().message;
    return out;
  }
  const bool has_own = own_rig(contents, *chosen).has_value();
  if (options.topics.empty() && options.calibration.empty() && !has_own) chosen->cameras = calibrated_cameras(contents, *chosen);
  for (const std::string& topic : chosen->cameras) {
    out.cameras.push_back(printable(topic));
    if (out.unreadable.empty() && !unreadable[topic].empty())
      out.unreadable = fmt::format("{}: {}", printable(topic), unreadable[topic]);
  }
  out.imu = printable(chosen->imu), out.depth = printable(chosen->depth);
  if (!options.calibration.empty() || has_own) return out;
  if (const auto rig = rig_of(contents, *chosen); !rig) out.no_calibration = rig.error().message;
  return out;
}

Result<BagSurvey> survey_bag(const std::string& path, const RecordingOptions& options) {
  auto bag = open_bag(path);
  if (!bag) return bag.error();
  return survey_bag(**bag, options);
}

}  // namespace fbvins
