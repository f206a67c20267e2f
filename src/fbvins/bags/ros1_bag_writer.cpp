// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/ros1_bag_writer.hpp"

#include <fmt/format.h>

#include <map>
#include <vector>

#include "fbvins/bags/ros1_messages.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/little_endian.hpp"
#include "fbvins/io/rig_text.hpp"
#include "fbvins/io/ros_messages.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kChunk_bytes = 768u << 10u;
constexpr std::size_t kBagHeader_bytes = 4096;
constexpr std::string_view kBagBegins = "#ROSBAG V2.0\n";

// Records: a header of fields, and data.

void add_field(std::string& header, std::string_view name, std::string_view value) {
  append_le(header, static_cast<std::uint32_t>(name.size() + 1 + value.size()));
  header.append(name).append("=").append(value);
}
template <class Number>
void add_number(std::string& header, std::string_view name, Number value) {
  std::string bytes;
  append_le(bytes, value);
  add_field(header, name, bytes);
}
std::string record(const std::string& header, std::string_view data) {
  std::string out;
  append_le(out, static_cast<std::uint32_t>(header.size()));
  out += header;
  append_le(out, static_cast<std::uint32_t>(data.size()));
  return out.append(data);
}
struct ChunkInfo {
  std::uint64_t at = 0;
  Time first, last;
  std::map<std::uint32_t, std::string> entries;  ///< of the index, by connection: time and place of each message
};

}  // namespace

struct Ros1BagWriter::State {
  State(AtomicFile opened, const StereoRig& rig)
      : file(std::move(opened)),
        depth_frame(rig.depth && rig.depth->own ? kDepthFrame : kLeftFrame),
        all(ros1::topics(rig)),
        time_offset(Duration::from_seconds(rig.time_offset_s)) {}

  AtomicFile file;
  std::string_view depth_frame;
  std::string chunk;
  ChunkInfo info;
  std::vector<ChunkInfo> chunks;
  std::vector<ros1::Topic> all;
  Duration time_offset;
  AidingSensors aiding;

  /// Of the images, where some have other names than usual; else empty.
  std::vector<std::string> renamed_images(int cameras) const {
    std::vector<std::string> out;
    bool renamed = false;
    for (int i = 0; i < cameras; ++i) {
      out.push_back(all[ros1::image_number(i)].name);
      renamed |= out.back() != bag_camera_topic(i);
    }
    return renamed ? out : std::vector<std::string>{};
  }

  Result<void> rename(const std::map<std::string, std::string>& names) {
    for (const auto& [before, after] : names) {
      const auto topic = std::ranges::find(all, before, &ros1::Topic::name);
      if (topic == all.end())
        return Error{ErrorCode::invalid_argument, fmt::format("a bag of this recording has no topic '{}'", before)};
      if (std::ranges::find(all, after, &ros1::Topic::name) != all.end())
        return Error{ErrorCode::invalid_argument, fmt::format("two topics would be '{}'", after)};
      topic->name = after;
    }
    return {};
  }

  void write(std::string_view bytes) { file.write(bytes); }
  Result<void> good() const { return file.status(); }

  std::string connection(std::uint32_t number) const {
    const ros1::Topic& topic = all[number];
    std::string header, about;
    add_number(header, "op", std::uint8_t{7});
    add_number(header, "conn", number);
    add_field(header, "topic", topic.name);
    add_field(about, "topic", topic.name);
    add_field(about, "type", topic.type);
    add_field(about, "md5sum", topic.checksum);
    add_field(about, "message_definition", topic.definition);
    return record(header, about);
  }

  Result<void> add(std::uint32_t number, Time t, const std::string& message) {
    constexpr Time kEnd{(std::int64_t{1} << 32) * ros1::kSecond_ns};
    if (t < Time{0} || t >= kEnd)
      return Error{ErrorCode::invalid_argument, fmt::format("{}: a stamp of {} ns is none of ROS's", file.path(), t.ns)};
    std::string& entries = info.entries[number];
    if (entries.empty()) chunk += connection(number);
    if (info.entries.size() == 1 && entries.empty()) info.first = info.last = t;
    info.first = std::min(info.first, t), info.last = std::max(info.last, t);
    append_le(entries, ros1::ros_time(t));
    append_le(entries, static_cast<std::uint32_t>(chunk.size()));
    std::string header;
    add_number(header, "op", std::uint8_t{2});
    add_number(header, "conn", number);
    add_number(header, "time", ros1::ros_time(t));
    chunk += record(header, message);
    if (chunk.size() >= kChunk_bytes) flush();
    return good();
  }

  void flush() {
    if (chunk.empty()) return;
    std::string header;
    add_number(header, "op", std::uint8_t{5});
    add_field(header, "compression", "none");
    add_number(header, "size", static_cast<std::uint32_t>(chunk.size()));
    info.at = file.size();
    write(record(header, chunk));
    for (const auto& [number, entries] : info.entries) {
      std::string index;
      add_number(index, "op", std::uint8_t{4});
      add_number(index, "ver", std::uint32_t{1});
      add_number(index, "conn", number);
      add_number(index, "count", static_cast<std::uint32_t>(entries.size() / kEntry_bytes));
      write(record(index, entries));
    }
    chunks.push_back(std::move(info));
    info = {};
    chunk.clear();
  }

  void write_index() {
    const std::uint64_t index_at = file.size();
    for (std::uint32_t number = 0; number < all.size(); ++number) write(connection(number));
    for (const ChunkInfo& c : chunks) {
      std::string header, counts;
      add_number(header, "op", std::uint8_t{6});
      add_number(header, "ver", std::uint32_t{1});
      add_number(header, "chunk_pos", c.at);
      add_number(header, "start_time", ros1::ros_time(c.first));
      add_number(header, "end_time", ros1::ros_time(c.last));
      add_number(header, "count", static_cast<std::uint32_t>(c.entries.size()));
      for (const auto& [number, entries] : c.entries) {
        append_le(counts, number);
        append_le(counts, static_cast<std::uint32_t>(entries.size() / kEntry_bytes));
      }
      write(record(header, counts));
    }
    file.overwrite(kBagBegins.size(), bag_header(index_at));
  }

  std::string bag_header(std::uint64_t index_at) const {
    std::string header;
    add_number(header, "op", std::uint8_t{3});
    add_number(header, "index_pos", index_at);
    add_number(header, "conn_count", static_cast<std::uint32_t>(all.size()));
    add_number(header, "chunk_count", static_cast<std::uint32_t>(chunks.size()));
    return record(header, std::string(kBagHeader_bytes - header.size() - 8, ' '));
  }

  static constexpr std::size_t kEntry_bytes = 8 + 4;
};

std::string bag_camera_topic(int camera) { return fmt::format("/cam{}/image_raw", camera); }

Result<Ros1BagWriter> Ros1BagWriter::create(const std::string& path, const StereoRig& rig, Time start,
                                            const std::map<std::string, std::string>& names) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  auto state = std::make_unique<State>(*std::move(file), rig);
  if (Result<void> done = state->rename(names); !done) return done.error();
  state->write(kBagBegins);
  state->write(state->bag_header(0));
  if (Result<void> done = state->good(); !done) return done.error();
  std::vector<std::pair<std::uint32_t, std::string>> messages;
  for (int i = 0; i < rig.camera_count(); ++i)
    messages.emplace_back(ros1::info_number(i), ros1::camera_message(start, camera_frame(i), rig.camera(i)));
  if (rig.depth && rig.depth->own)
    messages.emplace_back(ros1::kDepthInfo, ros1::camera_message(start, kDepthFrame, rig.depth->own->camera));
  messages.emplace_back(ros1::kTransforms, ros1::transforms_message(start, rig));
  messages.emplace_back(ros1::kRig, ros1::text_message(rig_to_yaml(rig, state->renamed_images(rig.camera_count()))));
  for (const auto& [number, message] : messages)
    if (Result<void> done = state->add(number, start, message); !done) return done.error();
  return Ros1BagWriter(std::move(state));
}

Ros1BagWriter::Ros1BagWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
Ros1BagWriter::~Ros1BagWriter() = default;
Ros1BagWriter::Ros1BagWriter(Ros1BagWriter&&) noexcept = default;
Ros1BagWriter& Ros1BagWriter::operator=(Ros1BagWriter&&) noexcept = default;

Result<void> Ros1BagWriter::add(const ImuSample& sample) { return state_->add(ros1::kImu, sample.t, ros1::imu_message(sample)); }

Result<void> Ros1BagWriter::add(const StereoFrame& frame) {
  for (int i = 0; i < static_cast<int>(frame.images.size()); ++i) {
    const std::shared_ptr<const Image>& image = frame.image(i);
    if (!image) continue;
    const std::string message = ros1::image_message(frame.t + frame.offsets.of(i), camera_frame(i), *image);
    if (Result<void> done = state_->add(ros1::image_number(i), frame.t, message); !done) return done;
  }
  if (!frame.depth) return {};
  return state_->add(ros1::kDepth, frame.t, ros1::depth_message(frame.t, state_->depth_frame, *frame.depth));
}

Result<void> Ros1BagWriter::add(const AidingSample& of_images) {
  AidingSample reading = of_images;
  const Time t = stamp_of(reading) = stamp_of(reading) + state_->time_offset;
  AidingSensors::Sensor* sensor = state_->aiding.find(reading);
  if (sensor == nullptr) {
    sensor = &state_->aiding.add(reading, state_->all.size());
    state_->all.push_back(ros1::aiding_topic("/" + sensor->name, reading));
    if (sensor->T_BS)
      if (Result<void> done = state_->add(ros1::kTransforms, t, ros1::transform_message(t, sensor->name, *sensor->T_BS)); !done)
        return done;
  }
  const std::string_view frame = sensor->T_BS ? std::string_view(sensor->name) : kBodyFrame;
  return state_->add(static_cast<std::uint32_t>(sensor->topic), t, aiding_message(reading, frame, Encoding::ros1));
}

Result<void> Ros1BagWriter::add_truth(Time t, const Pose<W, B>& T_WB) {
  return state_->add(ros1::kTruth, t, ros1::pose_message(t, "world", T_WB));
}

Result<void> Ros1BagWriter::add_odometry(Time t, const Pose<W, B>& T_WB) {
  return state_->add(ros1::kOdometry, t, ros1::pose_message(t, kOdometryFrame, T_WB));
}

Result<void> Ros1BagWriter::finish() {
  state_->flush();
  state_->write_index();
  return state_->file.commit();
}

}  // namespace fbvins
