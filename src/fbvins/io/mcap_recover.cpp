// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mcap_recover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <vector>

#include "fbvins/io/cdr.hpp"
#include "fbvins/io/flight_record.hpp"
#include "fbvins/io/mcap_reader.hpp"
#include "fbvins/io/mcap_writer.hpp"
#include "fbvins/io/rig_text.hpp"
#include "fbvins/io/ros_definitions.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kLargeChunk_bytes = 1'000'000;

/// All that is not a message, which is known when the file has been read once.
struct Contents {
  std::vector<McapTopic> topics;
  std::map<std::string, std::size_t> numbers;  ///< by topic
  std::string rig;                             ///< the calibration of a record that becomes a bag
  std::vector<McapAttachment> attachments;
  std::vector<McapMetadata> metadata;
  RecoveredMcap found;
};

Result<McapReader> open(const std::string& path) {
  const auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  return McapReader::open(*bytes, path);
}

Result<Contents> survey(const std::string& path) {
  Result<McapReader> reader = open(path);
  if (!reader) return reader.error();
  Contents out;
  while (reader->next()) ++out.found.messages;
  const McapDamage& damage = reader->damage();
  out.found.parts_left_out = damage.parts;
  out.found.first_damage = damage.first;
  out.found.was_cut_off = damage.ends_early || damage.no_summary;
  if (out.found.messages == 0)
    return Error{ErrorCode::malformed, damage.parts > 0 ? damage.first : path + ": holds no whole message"};
  for (const auto& [id, channel] : reader->channels()) {
    if (channel.message_encoding != "cdr" || channel.schema_encoding != "ros2msg")
      return Error{ErrorCode::unsupported, fmt::format("{}: '{}' has messages in {} by {}: only those of ROS 2 are written again",
                                                       path, channel.topic, channel.message_encoding, channel.schema_encoding)};
    if (out.numbers.try_emplace(channel.topic, out.topics.size()).second)
      out.topics.push_back({channel.topic, channel.schema_name, channel.definition});
  }
  out.attachments = reader->attachments();
  out.metadata = reader->metadata();
  return out;
}

/// Gives topics other names.
Result<void> rename(Contents& contents, const McapPart& part, const std::string& path) {
  for (const auto& [before, after] : part.names) {
    const auto at = contents.numbers.find(before);
    if (at == contents.numbers.end())
      return Error{ErrorCode::invalid_argument, fmt::format("{}: has no topic '{}'", path, before)};
    contents.topics[at->second].topic = after;
  }
  std::set<std::string> names;
  for (const McapTopic& topic : contents.topics)
    if (!names.insert(topic.topic).second)
      return Error{ErrorCode::invalid_argument, fmt::format("{}: two topics would be '{}'", path, topic.topic)};
  return {};
}

/// Takes the attached calibration for a message, which says of which topics it is.
Result<void> become_bag(Contents& contents, const std::string& path) {
  const auto attached = std::ranges::find(contents.attachments, kCalibrationAttachment, &McapAttachment::name);
  if (attached == contents.attachments.end()) return {};
  const Result<StereoRig> rig = parse_rig(attached->data, fmt::format("{}: {}", path, attached->name));
  if (!rig) return rig.error();
  std::vector<std::string> images;
  for (int i = 0; i < rig->camera_count(); ++i) {
    const auto topic = contents.numbers.find(camera_topic(i));
    images.push_back(topic == contents.numbers.end() ? camera_topic(i) : contents.topics[topic->second].topic);
  }
  contents.rig = with_topics(attached->data, images);
  contents.attachments.erase(attached);
  constexpr const char* kText = "std_msgs/msg/String";
  contents.topics.push_back({std::string(kRigTopic), kText, ros_definition(kText)});
  return {};
}

void write_rig(Contents& contents, McapWriter& writer, Time t) {
  CdrWriter cdr(writer.begin_message(contents.topics.size() - 1, t));
  cdr.text(contents.rig);
  writer.end_message();
  ++contents.found.messages, ++contents.found.topics.back().messages;
}

Result<void> write(Contents& contents, McapReader& reader, McapWriter& writer, const McapPart& part) {
  RecoveredMcap& written = contents.found;
  for (const McapAttachment& a : contents.attachments)
    if (Result<void> done = writer.attach(a.name, a.media_type, a.data); !done) return done;
  for (const McapMetadata& m : contents.metadata)
    if (Result<void> done = writer.add_metadata(m.name, m.values); !done) return done;
  while (const auto message = reader.next()) {
    if (message->log_time < part.from || message->log_time >= part.to) continue;
    if (written.messages == 0) {
      written.first = written.last = message->log_time;
      if (!contents.rig.empty()) write_rig(contents, writer, message->log_time);
    }
    const std::size_t topic = contents.numbers.at(message->channel->topic);
    writer.begin_message(topic, message->log_time) += message->data;
    writer.end_message();
    written.first = std::min(written.first, message->log_time);
    written.last = std::max(written.last, message->log_time);
    ++written.messages, ++written.topics[topic].messages;
    if (writer.waiting_bytes() < kLargeChunk_bytes) continue;
    if (Result<void> done = writer.flush(); !done) return done;
  }
  return writer.finish();
}

}  // namespace

Result<RecoveredMcap> recover_mcap(const std::string& in, const std::string& out, const McapPart& part) {
  Result<Contents> contents = survey(in);
  if (!contents) return contents.error();
  if (Result<void> done = rename(*contents, part, in); !done) return done.error();
  const bool bag = part.bag || !part.names.empty();
  if (bag)
    if (Result<void> done = become_bag(*contents, in); !done) return done.error();
  Result<McapReader> reader = open(in);
  if (!reader) return reader.error();
  // What names fbvins is taken for a flight record.
  Result<McapWriter> writer = McapWriter::create(out, {"ros2", bag ? "FB-VINS" : "fbvins"}, contents->topics);
  if (!writer) return writer.error();
  contents->found.messages = 0;
  for (const McapTopic& topic : contents->topics) contents->found.topics.push_back({topic.topic, topic.type, 0});
  const Result<void> written = write(*contents, *reader, *writer, part);
  if (!written) {
    std::error_code ignored;
    std::filesystem::remove(out, ignored);
    return written.error();
  }
  return contents->found;
}

}  // namespace fbvins
