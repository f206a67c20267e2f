// SPDX-License-Identifier: Apache-2.0
// Private to io: the messages of an MCAP file in their order, without need of an index. One thread.
//
//   Result<McapReader> file = McapReader::open(bytes, "flight.mcap");
//   while (auto message = file->next()) use(message->channel->topic, message->data);
//   file->damage();   // what could not be read, and where
//
// A file that ends too early is read up to its last whole record, in an unfinished chunk too. A chunk whose checksum is wrong
// is left out, as are malformed records; each is counted, the first one with its offset. Compressed chunks need an McapUnpack,
// which this module does not have.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/io/mcap_format.hpp"

namespace fbvins {

struct McapChannel {
  std::string topic, message_encoding, schema_name, schema_encoding, definition;
};

struct McapMessage {
  const McapChannel* channel = nullptr;  ///< lives as long as the reader
  Time log_time;
  std::string_view data;     ///< until next()
  std::uint64_t offset = 0;  ///< of data in the file; where `chunk` is not 0, in what records_of(chunk) gives
  std::uint64_t chunk = 0;   ///< the compressed chunk it lies in
};

/// Decompresses the records of a chunk (`size` bytes of them), or those before damage or the end of the bytes; nullopt for an
/// unknown compression.
using McapUnpack =
    std::function<std::optional<std::string>(std::string_view compression, std::string_view bytes, std::uint64_t size)>;

/// Whether to skip a chunk with messages of these channels, stamped from `first` to `last`.
using McapPassOver = std::function<bool(Time first, Time last, const std::vector<const McapChannel*>& channels)>;

struct McapAttachment {
  std::string name, media_type, data;
};

struct McapMetadata {
  std::string name;
  std::map<std::string, std::string> values;
};

struct McapDamage {
  int parts = 0;            ///< records and chunks left out
  std::string first;        ///< "file: byte N: sentence" about the first of them
  bool ends_early = false;  ///< no end of data was met: the writer was cut off
  bool no_summary = false;  ///< the footer names none: allowed, but our records have one unless their writer was cut off
  std::uint64_t end = 0;    ///< offset up to which it was read
};

class McapReader {
 public:
  /// `name` is only for messages. An error where this is not MCAP.
  static Result<McapReader> open(std::shared_ptr<const ByteSource> bytes, const std::string& name, McapUnpack unpack = {});

  /// `decide` is asked about each chunk that is followed by an index of its messages and whose channels are all known.
  void pass_over(McapPassOver decide) { pass_over_ = std::move(decide); }
  /// Nullopt at the end.
  std::optional<McapMessage> next();
  /// Those read so far.
  const std::vector<McapAttachment>& attachments() const { return attachments_; }
  const std::vector<McapMetadata>& metadata() const { return metadata_; }
  const std::map<std::uint16_t, McapChannel>& channels() const { return channels_; }
  const McapDamage& damage() const { return damage_; }
  /// The records of a compressed chunk again.
  std::string records_of(std::uint64_t chunk) const;
  /// Counts something that the caller could not use.
  void complain(std::uint64_t offset, const std::string& sentence);

 private:
  struct ChunkHead {
    std::uint32_t checksum = 0;
    std::string compression;
    std::uint64_t unpacked = 0, records = 0;  ///< sizes
    std::size_t length = 0;                   ///< of the head itself
  };

  McapReader(std::shared_ptr<const ByteSource> bytes, std::string name, McapUnpack unpack)
      : bytes_(std::move(bytes)), name_(std::move(name)), unpack_(std::move(unpack)) {}
  std::optional<ChunkHead> chunk_head(std::uint64_t offset, std::uint64_t length) const;
  bool load_next();
  bool is_passed_over(std::uint64_t chunk, std::uint64_t behind) const;
  bool cut_off(std::uint64_t at);
  bool load_records(std::uint64_t offset, std::uint64_t length);
  void load_chunk(std::uint64_t offset, std::uint64_t length, bool whole);
  void load_attachment(std::uint64_t offset, std::uint64_t length);
  void load_metadata(std::uint64_t offset, std::uint64_t length);
  std::optional<McapMessage> next_loaded();
  void take_schema(ByteCursor& in);
  void take_channel(ByteCursor& in, std::uint64_t offset);
  std::optional<McapMessage> take_message(std::string_view content, std::uint64_t offset);

  std::shared_ptr<const ByteSource> bytes_;
  std::string name_;
  McapUnpack unpack_;
  McapPassOver pass_over_;
  std::uint64_t next_ = 0;           ///< the next record outside of chunks
  std::string loaded_;               ///< records in work
  std::uint64_t loaded_offset_ = 0;  ///< their place in the file; 0 where they were unpacked
  std::uint64_t loaded_chunk_ = 0;   ///< the chunk they were unpacked from
  std::size_t position_ = 0;         ///< in loaded_
  bool loaded_whole_ = true;         ///< false: the file ends inside of them
  struct Schema {
    std::string name, encoding, definition;
  };
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::vector<McapAttachment> attachments_;
  std::vector<McapMetadata> metadata_;
  McapDamage damage_;
};

}  // namespace fbvins
