// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestChunk_bytes = std::uint64_t{256} << 20u;
constexpr std::uint64_t kLargestAttachment_bytes = std::uint64_t{4} << 20u;  // larger ones are not read

}  // namespace

Result<McapReader> McapReader::open(std::shared_ptr<const ByteSource> bytes, const std::string& name, McapUnpack unpack) {
  McapReader reader(std::move(bytes), name, std::move(unpack));
  if (reader.bytes_->read(0, kMcapMagic.size()) != kMcapMagic)
    return Error{ErrorCode::malformed, fmt::format("{}: does not begin as an MCAP file does", name)};
  reader.next_ = kMcapMagic.size();
  return reader;
}

void McapReader::complain(std::uint64_t offset, const std::string& sentence) {
  if (damage_.parts++ == 0) damage_.first = fmt::format("{}: byte {}: {}", name_, offset, sentence);
}

std::optional<McapMessage> McapReader::next() {
  while (true) {
    if (auto message = next_loaded()) return message;
    if (!load_next()) return std::nullopt;
  }
}

/// The file ends inside of the record at `at`, or there is none.
bool McapReader::cut_off(std::uint64_t at) {
  damage_.ends_early = true;
  damage_.end = at;
  next_ = bytes_->size();
  return false;
}

/// Goes on to the next record outside of chunks; false at the end of the data.
bool McapReader::load_next() {
  const std::uint64_t at = next_;
  const std::string head = bytes_->read(at, kMcapRecordHead_bytes);
  if (head.size() < kMcapRecordHead_bytes) return cut_off(damage_.ends_early ? damage_.end : at);
  ByteCursor in(head);
  const auto kind = static_cast<McapRecord>(in.get<std::uint8_t>());
  const auto length = in.get<std::uint64_t>();
  const std::uint64_t there = bytes_->size() - at - kMcapRecordHead_bytes;
  if (kind == McapRecord::data_end || kind == McapRecord::footer) {
    const std::uint64_t footer = kind == McapRecord::footer ? at : at + kMcapRecordHead_bytes + length;
    const std::string bytes = bytes_->read(footer, kMcapRecordHead_bytes + sizeof(std::uint64_t));
    ByteCursor behind(bytes);
    const bool is_footer = static_cast<McapRecord>(behind.get<std::uint8_t>()) == McapRecord::footer;
    behind.skip(sizeof(std::uint64_t));
    damage_.no_summary = is_footer && behind.get<std::uint64_t>() == 0 && behind.ok();
    return damage_.end = at, next_ = at, false;
  }
  if (kind == McapRecord{0}) {
    complain(at, "there is no record here, and what follows cannot be read");
    return cut_off(at);
  }
  const bool whole = length <= there;
  next_ = whole ? at + kMcapRecordHead_bytes + length : bytes_->size();
  if (kind == McapRecord::chunk && !(pass_over_ && whole && is_passed_over(at + kMcapRecordHead_bytes, next_)))
    load_chunk(at + kMcapRecordHead_bytes, std::min(length, there), whole);
  if (!whole) {
    damage_.ends_early = true;
    damage_.end = at;
    return kind == McapRecord::chunk;
  }
  if (kind == McapRecord::schema || kind == McapRecord::channel || kind == McapRecord::message)
    load_records(at, kMcapRecordHead_bytes + length);
  if (kind == McapRecord::attachment) load_attachment(at + kMcapRecordHead_bytes, length);
  if (kind == McapRecord::metadata) load_metadata(at + kMcapRecordHead_bytes, length);
  return true;  // other kinds are passed over
}

/// `behind` is where the chunk ends, and the indexes of its channels begin.
bool McapReader::is_passed_over(std::uint64_t chunk, std::uint64_t behind) const {
  const std::string stamps = bytes_->read(chunk, 2 * sizeof(std::uint64_t));
  std::vector<const McapChannel*> channels;
  for (std::uint64_t at = behind;;) {
    const std::string bytes = bytes_->read(at, kMcapRecordHead_bytes + sizeof(std::uint16_t));
    ByteCursor in(bytes);
    const auto kind = static_cast<McapRecord>(in.get<std::uint8_t>());
    const auto length = in.get<std::uint64_t>();
    const auto known = channels_.find(in.get<std::uint16_t>());
    if (!in.ok() || kind != McapRecord::message_index || length > bytes_->size()) break;
    if (known == channels_.end()) return false;
    channels.push_back(&known->second);
    at += kMcapRecordHead_bytes + length;
  }
  ByteCursor in(stamps);
  const Time first{static_cast<std::int64_t>(in.get<std::uint64_t>())}, last{static_cast<std::int64_t>(in.get<std::uint64_t>())};
  return in.ok() && !channels.empty() && pass_over_(first, last, channels);
}

/// False where these are too many to be loaded.
bool McapReader::load_records(std::uint64_t offset, std::uint64_t length) {
  if (length > kLargestChunk_bytes) {
    complain(offset, fmt::format("{} bytes in one piece are too many", length));
    return false;
  }
  loaded_ = bytes_->read(offset, length);
  loaded_offset_ = offset;
  loaded_chunk_ = 0;
  position_ = 0;
  loaded_whole_ = true;
  return true;
}

std::optional<McapReader::ChunkHead> McapReader::chunk_head(std::uint64_t offset, std::uint64_t length) const {
  const std::string bytes = bytes_->read(offset, std::min<std::uint64_t>(length, 100));
  ByteCursor in(bytes);
  in.skip(8 + 8);  // first stamp, last stamp
  ChunkHead head;
  head.unpacked = in.get<std::uint64_t>();
  head.checksum = in.get<std::uint32_t>();
  head.compression = take_mcap_text(in);
  head.records = in.get<std::uint64_t>();
  head.length = in.position();
  return in.ok() ? std::optional(std::move(head)) : std::nullopt;
}

/// A complete chunk is used only if its checksum matches (0: it has none); one that the file ends in is read as far as it goes.
void McapReader::load_chunk(std::uint64_t offset, std::uint64_t length, bool whole) {
  const std::optional<ChunkHead> head = chunk_head(offset, length);
  if (!head) return whole ? complain(offset, "this chunk's head is not what it should be") : void();
  const std::uint64_t there = length - head->length;
  if (whole && head->records > there) return complain(offset, "this chunk's messages are longer than the chunk");
  if (!load_records(offset + head->length, std::min(head->records, there))) return;
  loaded_whole_ = whole;
  if (!head->compression.empty()) {
    std::optional<std::string> records = unpack_ ? unpack_(head->compression, loaded_, head->unpacked) : std::nullopt;
    loaded_ = std::move(records).value_or("");
    loaded_offset_ = 0;
    loaded_chunk_ = offset;
    if (!records)
      return complain(offset, fmt::format("this chunk is compressed by '{}', and {}", fbvins::quoted(head->compression),
                                          unpack_ ? "that cannot be read" : "only uncompressed ones are read"));
  }
  if (!whole || head->checksum == 0 || crc32_of(loaded_) == head->checksum) return;
  loaded_.clear();
  complain(offset, "this chunk's checksum is wrong");
}

std::string McapReader::records_of(std::uint64_t chunk) const {
  const std::optional<ChunkHead> head = chunk_head(chunk, bytes_->size() - std::min(chunk, bytes_->size()));
  if (!head || !unpack_) return {};
  return unpack_(head->compression, bytes_->read(chunk + head->length, head->records), head->unpacked).value_or("");
}

void McapReader::load_attachment(std::uint64_t offset, std::uint64_t length) {
  if (length > kLargestAttachment_bytes) return;
  const std::string bytes = bytes_->read(offset, length);
  ByteCursor in(bytes);
  in.skip(8 + 8);  // times
  const std::string_view name = take_mcap_text(in);
  const std::string_view media_type = take_mcap_text(in);
  const std::string_view data = in.take(in.get<std::uint64_t>());
  const std::size_t end = in.position();
  const auto checksum = in.get<std::uint32_t>();
  if (!in.ok()) return complain(offset, "this attachment is not what it should be");
  if (checksum != 0 && crc32_of(std::string_view(bytes).substr(0, end)) != checksum)
    return complain(offset, fmt::format("the checksum of the attachment '{}' is wrong", fbvins::quoted(name)));
  attachments_.push_back({std::string(name), std::string(media_type), std::string(data)});
}

void McapReader::load_metadata(std::uint64_t offset, std::uint64_t length) {
  if (length > kLargestAttachment_bytes) return;
  const std::string bytes = bytes_->read(offset, length);
  ByteCursor in(bytes);
  McapMetadata out{std::string(take_mcap_text(in)), {}};
  ByteCursor pairs(take_mcap_text(in));
  while (in.ok() && pairs.ok() && pairs.left() > 0) {
    const std::string key(take_mcap_text(pairs));
    out.values[key] = take_mcap_text(pairs);
  }
  if (!in.ok() || !pairs.ok()) return complain(offset, "this metadata is not what it should be");
  metadata_.push_back(std::move(out));
}

/// The next message of what is loaded.
std::optional<McapMessage> McapReader::next_loaded() {
  while (position_ < loaded_.size()) {
    const std::uint64_t at = loaded_offset_ + position_;
    ByteCursor in(std::string_view(loaded_).substr(position_));
    const auto kind = static_cast<McapRecord>(in.get<std::uint8_t>());
    const std::string_view content = in.take(in.get<std::uint64_t>());
    if (!in.ok() || kind == McapRecord{0}) {
      if (loaded_whole_) complain(at, "there is no whole record here in the chunk");
      position_ = loaded_.size();
      return std::nullopt;
    }
    position_ += in.position();
    if (!loaded_whole_ && loaded_chunk_ == 0) damage_.end = loaded_offset_ + position_;
    ByteCursor record(content);
    if (kind == McapRecord::schema) take_schema(record);
    if (kind == McapRecord::channel) take_channel(record, at);
    if (kind != McapRecord::message) continue;
    if (auto message = take_message(content, at + kMcapRecordHead_bytes)) return message;
  }
  return std::nullopt;
}

void McapReader::take_schema(ByteCursor& in) {
  const auto id = in.get<std::uint16_t>();
  const std::string_view name = take_mcap_text(in), encoding = take_mcap_text(in), definition = take_mcap_text(in);
  if (in.ok()) schemas_.try_emplace(id, Schema{std::string(name), std::string(encoding), std::string(definition)});
}

void McapReader::take_channel(ByteCursor& in, std::uint64_t offset) {
  const auto id = in.get<std::uint16_t>(), schema = in.get<std::uint16_t>();
  const std::string_view topic = take_mcap_text(in), encoding = take_mcap_text(in);
  if (!in.ok()) return complain(offset, "this channel is not what it should be");
  const auto known = schemas_.find(schema);
  const Schema schema_of = known == schemas_.end() ? Schema{} : known->second;
  channels_.try_emplace(
      id, McapChannel{std::string(topic), std::string(encoding), schema_of.name, schema_of.encoding, schema_of.definition});
}

std::optional<McapMessage> McapReader::take_message(std::string_view content, std::uint64_t offset) {
  ByteCursor in(content);
  const auto channel = channels_.find(in.get<std::uint16_t>());
  in.skip(sizeof(std::uint32_t));  // sequence
  const auto log_ns = in.get<std::uint64_t>();
  in.skip(sizeof(std::uint64_t));  // time of publishing
  if (!in.ok() || channel == channels_.end()) {
    complain(offset, "this message is of no known channel");
    return std::nullopt;
  }
  return McapMessage{&channel->second, Time{static_cast<std::int64_t>(log_ns)}, content.substr(kMcapMessageHead_bytes),
                     offset + kMcapMessageHead_bytes, loaded_chunk_};
}

}  // namespace fbvins
