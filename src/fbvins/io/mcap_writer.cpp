// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mcap_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <utility>

#include "fbvins/io/mcap_format.hpp"

namespace fbvins {
namespace {

std::uint64_t stamp_of(Time t) { return static_cast<std::uint64_t>(std::max<std::int64_t>(t.ns, 0)); }

void append_header(std::string& out, const McapLabel& label) {
  const std::size_t start = begin_mcap_record(out, McapRecord::header);
  append_mcap_text(out, label.profile);
  append_mcap_text(out, label.library);
  end_mcap_record(out, start);
}

void append_schema(std::string& out, std::uint16_t id, const McapTopic& topic) {
  const std::size_t start = begin_mcap_record(out, McapRecord::schema);
  append_le(out, id);
  append_mcap_text(out, topic.type);
  append_mcap_text(out, "ros2msg");
  append_mcap_text(out, topic.definition);
  end_mcap_record(out, start);
}

void append_channel(std::string& out, std::uint16_t id, std::uint16_t schema, const McapTopic& topic) {
  const std::size_t start = begin_mcap_record(out, McapRecord::channel);
  append_le(out, id);
  append_le(out, schema);
  append_mcap_text(out, topic.topic);
  append_mcap_text(out, "cdr");
  // The profile "ros2" requires this key; empty stands for the defaults.
  std::string metadata;
  append_mcap_text(metadata, "offered_qos_profiles");
  append_mcap_text(metadata, "");
  append_mcap_text(out, metadata);
  end_mcap_record(out, start);
}

/// A footer and the magic, which end a file.
constexpr std::size_t kFooter_bytes = kMcapRecordHead_bytes + 8 + 8 + 4 + kMcapMagic.size();

/// An end of the data, and a footer that names no summary.
std::string provisional_end_of_file() {
  std::string out;
  const std::size_t end = begin_mcap_record(out, McapRecord::data_end);
  append_le(out, std::uint32_t{0});
  end_mcap_record(out, end);
  const std::size_t footer = begin_mcap_record(out, McapRecord::footer);
  append_le(out, std::uint64_t{0});
  append_le(out, std::uint64_t{0});
  append_le(out, std::uint32_t{0});
  end_mcap_record(out, footer);
  return out.append(kMcapMagic);
}

}  // namespace

Result<McapWriter> McapWriter::create(const std::string& path, const McapLabel& label, const std::vector<McapTopic>& topics) {
  FileDescriptor file(::open(path.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0644));
  if (!file && errno == EEXIST)
    return Error{ErrorCode::unwritable, fmt::format("{}: exists already, and a record is never overwritten", path)};
  if (!file) return Error{ErrorCode::unwritable, fmt::format("{}: cannot be written ({})", path, std::strerror(errno))};
  McapWriter writer(path, std::move(file), topics);
  std::string bytes(kMcapMagic);
  append_header(bytes, label);
  if (Result<void> written = writer.write_all(bytes + writer.schemas_ + writer.channel_records_); !written)
    return written.error();
  return writer;
}

McapWriter::McapWriter(std::string path, FileDescriptor file, const std::vector<McapTopic>& topics)
    : path_(std::move(path)), file_(std::move(file)) {
  for (const McapTopic& topic : topics) append_topic(topic);
  clear_chunk();
}

/// To the records of all topics, with its type where that is a new one.
void McapWriter::append_topic(const McapTopic& topic) {
  const auto [schema, is_new] = schema_of_.try_emplace(topic.type, static_cast<std::uint16_t>(schema_of_.size() + 1));
  if (is_new) append_schema(schemas_, schema->second, topic);
  append_channel(channel_records_, mcap_channel_id(channels_.size()), schema->second, topic);
  channels_.emplace_back();
}

Result<std::size_t> McapWriter::add_topic(const McapTopic& topic) {
  const std::size_t schemas = schemas_.size(), channels = channel_records_.size();
  append_topic(topic);
  const std::string records = schemas_.substr(schemas) + channel_records_.substr(channels);
  if (Result<void> written = write_record(records); !written) return written.error();
  return channels_.size() - 1;
}

Result<void> McapWriter::write_at(std::uint64_t offset, std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t now = ::pwrite(file_.number(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0)
      return Error{ErrorCode::unwritable, fmt::format("{}: writing failed ({})", path_, std::strerror(now < 0 ? errno : ENOSPC))};
    bytes.remove_prefix(static_cast<std::size_t>(now));
    offset += static_cast<std::uint64_t>(now);
  }
  return {};
}

/// A large write that is interrupted by the end of the process is done in part. So the new end comes first, and the bytes over
/// the old end come last: before them the file ends, for who reads it from its start, where it did. Only what is small
/// overwrites.
Result<void> McapWriter::write_all(const std::string& bytes, bool provisional_end) {
  const std::string end = provisional_end_of_file(), all = provisional_end ? bytes + end : bytes;
  const std::size_t footer = all.size() - kFooter_bytes, first = std::min(end.size(), footer);
  const std::string_view whole(all);
  const std::pair<std::size_t, std::string_view> parts[] = {{footer, std::string_view(end).substr(end.size() - kFooter_bytes)},
                                                            {first, whole.substr(first, footer - first)},
                                                            {0, whole.substr(0, first)},
                                                            {footer, whole.substr(footer)}};
  for (const auto& [at, part] : parts)
    if (Result<void> written = write_at(end_ + at, part); !written) return take_back(), written;
  end_ += bytes.size();
  return {};
}

/// A part that did not fit is removed, so that the file stays readable.
void McapWriter::take_back() const {
  const std::string end = end_ > 0 ? provisional_end_of_file() : "";
  [[maybe_unused]] const int cut = ::ftruncate(file_.number(), static_cast<off_t>(end_ + end.size()));
  [[maybe_unused]] const Result<void> restored = write_at(end_, end);
}

/// A record outside of chunks comes after what is waiting.
Result<void> McapWriter::write_record(const std::string& record) {
  if (Result<void> flushed = flush(); !flushed) return flushed;
  return write_all(record);
}

Result<void> McapWriter::attach(const std::string& name, const std::string& media_type, const std::string& data) {
  std::string record;
  const std::size_t start = begin_mcap_record(record, McapRecord::attachment);
  append_le(record, std::uint64_t{0});  // times of recording and of making: not known on the sensors' clock
  append_le(record, std::uint64_t{0});
  append_mcap_text(record, name);
  append_mcap_text(record, media_type);
  append_le(record, static_cast<std::uint64_t>(data.size()));
  record += data;
  append_le(record, crc32_of(std::string_view(record).substr(kMcapRecordHead_bytes)));
  end_mcap_record(record, start);
  if (Result<void> written = write_record(record); !written) return written;
  const std::size_t index = begin_mcap_record(attachment_indexes_, McapRecord::attachment_index);
  append_le(attachment_indexes_, static_cast<std::uint64_t>(end_ - record.size()));
  append_le(attachment_indexes_, static_cast<std::uint64_t>(record.size()));
  append_le(attachment_indexes_, std::uint64_t{0});
  append_le(attachment_indexes_, std::uint64_t{0});
  append_le(attachment_indexes_, static_cast<std::uint64_t>(data.size()));
  append_mcap_text(attachment_indexes_, name);
  append_mcap_text(attachment_indexes_, media_type);
  end_mcap_record(attachment_indexes_, index);
  ++attachments_;
  return {};
}

Result<void> McapWriter::add_metadata(const std::string& name, const std::map<std::string, std::string>& values) {
  std::string pairs;
  for (const auto& [key, value] : values) {
    append_mcap_text(pairs, key);
    append_mcap_text(pairs, value);
  }
  std::string record;
  const std::size_t start = begin_mcap_record(record, McapRecord::metadata);
  append_mcap_text(record, name);
  append_mcap_text(record, pairs);
  end_mcap_record(record, start);
  if (Result<void> written = write_record(record); !written) return written;
  const std::size_t index = begin_mcap_record(metadata_indexes_, McapRecord::metadata_index);
  append_le(metadata_indexes_, static_cast<std::uint64_t>(end_ - record.size()));
  append_le(metadata_indexes_, static_cast<std::uint64_t>(record.size()));
  append_mcap_text(metadata_indexes_, name);
  end_mcap_record(metadata_indexes_, index);
  ++metadata_;
  return {};
}

std::string& McapWriter::begin_message(std::size_t topic, Time t) {
  Channel& to = channels_.at(topic);
  const std::uint64_t stamp = stamp_of(t);
  waiting_.first_ns = has_messages_ ? std::min(waiting_.first_ns, stamp) : stamp;
  waiting_.last_ns = std::max(waiting_.last_ns, stamp);
  has_messages_ = true;
  append_le(to.waiting_index, stamp);
  append_le(to.waiting_index, static_cast<std::uint64_t>(chunk_.size() - kMcapChunkHead_bytes));
  message_ = begin_mcap_record(chunk_, McapRecord::message);
  append_le(chunk_, mcap_channel_id(topic));
  append_le(chunk_, to.next_sequence++);
  append_le(chunk_, stamp);  // recorded
  append_le(chunk_, stamp);  // published
  return chunk_;
}

void McapWriter::end_message() { end_mcap_record(chunk_, message_); }

/// Fills in the chunk's head and appends the index of its messages.
void McapWriter::close_chunk() {
  waiting_.offset = end_;
  waiting_.chunk_bytes = chunk_.size();
  const std::uint64_t records = chunk_.size() - kMcapChunkHead_bytes;
  std::string head;
  begin_mcap_record(head, McapRecord::chunk);
  overwrite_le(head, 1, static_cast<std::uint64_t>(chunk_.size() - kMcapRecordHead_bytes));
  append_le(head, waiting_.first_ns);
  append_le(head, waiting_.last_ns);
  append_le(head, records);
  append_le(head, crc32_of(std::string_view(chunk_).substr(kMcapChunkHead_bytes)));
  append_mcap_text(head, "");  // not compressed
  append_le(head, records);
  assert(head.size() == kMcapChunkHead_bytes);
  std::copy(head.begin(), head.end(), chunk_.begin());
  for (std::size_t id = 0; id < channels_.size(); ++id) {
    if (channels_[id].waiting_index.empty()) continue;
    const std::size_t start = begin_mcap_record(chunk_, McapRecord::message_index);
    append_le(chunk_, mcap_channel_id(id));
    append_mcap_text(chunk_, channels_[id].waiting_index);
    end_mcap_record(chunk_, start);
  }
  waiting_.index_bytes = chunk_.size() - waiting_.chunk_bytes;
}

void McapWriter::clear_chunk() {
  chunk_.assign(kMcapChunkHead_bytes, '\0');
  waiting_ = {};
  has_messages_ = false;
  for (Channel& channel : channels_) channel.waiting_index.clear();
}

Result<void> McapWriter::flush() {
  if (!has_messages_) return {};
  close_chunk();
  Result<void> written = write_all(chunk_);
  if (written) {
    chunks_.push_back(waiting_);
    for (Channel& channel : channels_) channel.written += channel.waiting_index.size() / kMcapIndexEntry_bytes;
  }
  clear_chunk();
  return written;
}

Result<void> McapWriter::finish() {
  if (Result<void> flushed = flush(); !flushed) return flushed;
  std::string end;
  const std::size_t start = begin_mcap_record(end, McapRecord::data_end);
  append_le(end, std::uint32_t{0});  // no checksum of all: the chunks have their own
  end_mcap_record(end, start);
  Result<void> written = write_all(end + summary(end_ + end.size()) + std::string(kMcapMagic), false);
  sync();
  return written;
}

void McapWriter::sync() const { ::fdatasync(file_.number()); }

}  // namespace fbvins
