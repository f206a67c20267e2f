// SPDX-License-Identifier: Apache-2.0
// The summary at the end of an MCAP file, by which programs seek: its topics, the number of messages of each, the offsets of
// the chunks.
#include <algorithm>

#include "fbvins/io/mcap_format.hpp"
#include "fbvins/io/mcap_writer.hpp"

namespace fbvins {

/// Summary, its own index, footer; `start` is where it will lie in the file.
std::string McapWriter::summary(std::uint64_t start) const {
  std::string out, offsets;
  const auto add = [&](McapRecord kind, const std::string& records) {
    if (records.empty()) return;
    const std::size_t entry = begin_mcap_record(offsets, McapRecord::summary_offset);
    append_le(offsets, static_cast<std::uint8_t>(kind));
    append_le(offsets, static_cast<std::uint64_t>(start + out.size()));
    append_le(offsets, static_cast<std::uint64_t>(records.size()));
    end_mcap_record(offsets, entry);
    out += records;
  };
  add(McapRecord::schema, schemas_);
  add(McapRecord::channel, channel_records_);
  add(McapRecord::statistics, statistics());
  add(McapRecord::chunk_index, chunk_indexes());
  add(McapRecord::attachment_index, attachment_indexes_);
  add(McapRecord::metadata_index, metadata_indexes_);
  const std::uint64_t offsets_start = start + out.size();
  out += offsets;
  const std::size_t footer = begin_mcap_record(out, McapRecord::footer);
  append_le(out, start);
  append_le(out, offsets_start);
  overwrite_le(out, footer + 1, std::uint64_t{8 + 8 + 4});  // the length counts for the checksum
  append_le(out, crc32_of(out));
  return out;
}

std::string McapWriter::statistics() const {
  std::string counts;
  std::uint64_t messages = 0;
  for (std::size_t id = 0; id < channels_.size(); ++id) {
    if (channels_[id].written == 0) continue;
    append_le(counts, mcap_channel_id(id));
    append_le(counts, channels_[id].written);
    messages += channels_[id].written;
  }
  std::uint64_t first_ns = chunks_.empty() ? 0 : chunks_.front().first_ns, last_ns = 0;
  for (const ChunkPlace& chunk : chunks_) {
    first_ns = std::min(first_ns, chunk.first_ns);
    last_ns = std::max(last_ns, chunk.last_ns);
  }
  std::string out;
  const std::size_t start = begin_mcap_record(out, McapRecord::statistics);
  append_le(out, messages);
  append_le(out, static_cast<std::uint16_t>(schema_of_.size()));
  append_le(out, static_cast<std::uint32_t>(channels_.size()));
  append_le(out, attachments_);
  append_le(out, metadata_);
  append_le(out, static_cast<std::uint32_t>(chunks_.size()));
  append_le(out, first_ns);
  append_le(out, last_ns);
  append_mcap_text(out, counts);
  end_mcap_record(out, start);
  return out;
}

std::string McapWriter::chunk_indexes() const {
  std::string out;
  for (const ChunkPlace& chunk : chunks_) out += chunk_index(chunk);
  return out;
}

std::string McapWriter::chunk_index(const ChunkPlace& place) const {
  const std::uint64_t records = place.chunk_bytes - kMcapChunkHead_bytes;
  std::string out;
  const std::size_t start = begin_mcap_record(out, McapRecord::chunk_index);
  append_le(out, place.first_ns);
  append_le(out, place.last_ns);
  append_le(out, place.offset);
  append_le(out, place.chunk_bytes);
  append_mcap_text(out, places_of_message_indexes(place));
  append_le(out, place.index_bytes);
  append_mcap_text(out, "");  // not compressed
  append_le(out, records);
  append_le(out, records);
  end_mcap_record(out, start);
  return out;
}

/// Read back from the file, so that an hour's record keeps but a few numbers a chunk in memory.
std::string McapWriter::places_of_message_indexes(const ChunkPlace& place) const {
  const std::uint64_t first = place.offset + place.chunk_bytes;
  std::string indexes(place.index_bytes, '\0'), out;
  const ssize_t read = ::pread(file_.number(), indexes.data(), indexes.size(), static_cast<off_t>(first));
  if (read != static_cast<ssize_t>(indexes.size())) return out;  // an empty map stands for unknown
  ByteCursor in(indexes);
  while (in.left() >= kMcapRecordHead_bytes + sizeof(std::uint16_t)) {
    const std::uint64_t offset = first + in.position();
    in.skip(1);
    const auto length = in.get<std::uint64_t>();
    append_le(out, in.get<std::uint16_t>());
    append_le(out, offset);
    in.skip(length - sizeof(std::uint16_t));
  }
  return out;
}

}  // namespace fbvins
