// SPDX-License-Identifier: Apache-2.0
// Private to io: the names and numbers of the MCAP container (mcap.dev/spec), which its writer and its reader share.
//
// A file is magic, header, data section, data end, summary, footer, magic; each record one byte of kind, eight of length,
// content. Messages lie in chunks, each followed by an index of its messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "fbvins/io/little_endian.hpp"

namespace fbvins {

inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};

enum class McapRecord : std::uint8_t {
  header = 0x01,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
};

inline constexpr std::size_t kMcapRecordHead_bytes = 9;
/// A chunk's fields before its messages, where no compression is named.
inline constexpr std::size_t kMcapChunkHead_bytes = kMcapRecordHead_bytes + 8 + 8 + 8 + 4 + 4 + 8;
/// channel, sequence, log time, publish time.
inline constexpr std::size_t kMcapMessageHead_bytes = 2 + 4 + 8 + 8;
/// Of a message index: stamp and offset.
inline constexpr std::size_t kMcapIndexEntry_bytes = 16;

/// Channels count from 1: some readers take 0 for none.
constexpr std::uint16_t mcap_channel_id(std::size_t topic) { return static_cast<std::uint16_t>(topic + 1); }

/// The checksum of zip and PNG. Continues from `so_far`.
std::uint32_t crc32_of(std::string_view bytes, std::uint32_t so_far = 0);

inline void append_mcap_text(std::string& out, std::string_view text) {
  append_le(out, static_cast<std::uint32_t>(text.size()));
  out.append(text);
}

inline std::string_view take_mcap_text(ByteCursor& in) { return in.take(in.get<std::uint32_t>()); }

/// Begins a record; its length is filled in by end_mcap_record(out, what this returned).
inline std::size_t begin_mcap_record(std::string& out, McapRecord kind) {
  const std::size_t start = out.size();
  append_le(out, static_cast<std::uint8_t>(kind));
  append_le(out, std::uint64_t{0});
  return start;
}

inline void end_mcap_record(std::string& out, std::size_t start) {
  overwrite_le(out, start + 1, static_cast<std::uint64_t>(out.size() - start - kMcapRecordHead_bytes));
}

}  // namespace fbvins
