// SPDX-License-Identifier: Apache-2.0
// Private: writes an MCAP file that is readable whenever the process dies. One thread at a time.
//
//   auto file = McapWriter::create("flight.mcap", {"ros2", "fbvins"}, {{"/imu", "sensor_msgs/msg/Imu", definition}});
//   append_imu(file->begin_message(0, t), sample);
//   file->end_message();
//   file->flush();                              // a chunk
//   file->finish();                             // index, statistics, footer
//
// What begin_message() takes is in memory until flush(): how long is the choice of the caller, who has a clock.
// A file without finish() is whole up to its last chunk, and has an end, whatever write the process died in: behind each chunk
// lies a provisional end, over which the next chunk is written, its first bytes last. It only lacks the index by which programs
// seek, and those that insist on an end read it, too.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

/// A stream of messages of one type, in ROS 2's encoding.
struct McapTopic {
  std::string topic;
  std::string type;        ///< "sensor_msgs/msg/Imu"
  std::string definition;  ///< ros2msg, with the types that it is made of
};

struct McapLabel {
  std::string profile, library;
};

class McapWriter {
 public:
  /// Messages name their topic by its index in `topics`. An error where the file exists already: a record is never
  /// overwritten.
  static Result<McapWriter> create(const std::string& path, const McapLabel& label, const std::vector<McapTopic>& topics);

  /// One more topic; its index.
  Result<std::size_t> add_topic(const McapTopic& topic);
  // These are written at once.
  Result<void> attach(const std::string& name, const std::string& media_type, const std::string& data);
  Result<void> add_metadata(const std::string& name, const std::map<std::string, std::string>& values);

  /// The message's bytes are appended to what this returns, then end_message() is called. A negative stamp becomes 0.
  std::string& begin_message(std::size_t topic, Time t);
  void end_message();
  std::size_t waiting_bytes() const { return chunk_.size(); }

  /// Writes what is waiting. After an error (disk full) that part is lost, and the file is whole without it.
  Result<void> flush();
  Result<void> finish();
  /// Flushes what is written to the disk itself, against loss of power. May run beside the writing thread.
  void sync() const;

 private:
  struct Channel {
    std::uint32_t next_sequence = 0;
    std::uint64_t written = 0;
    std::string waiting_index;  ///< stamp and place of each message of the waiting chunk
  };
  /// What a chunk's index needs beyond what the file holds.
  struct ChunkPlace {
    std::uint64_t offset = 0;
    std::uint64_t first_ns = 0, last_ns = 0;
    std::uint64_t chunk_bytes = 0;
    std::uint64_t index_bytes = 0;
  };

  McapWriter(std::string path, FileDescriptor file, const std::vector<McapTopic>& topics);
  /// `provisional_end`: with an end behind it that is not counted, so that it is overwritten.
  Result<void> write_all(const std::string& bytes, bool provisional_end = true);
  Result<void> write_at(std::uint64_t offset, std::string_view bytes) const;
  void take_back() const;
  Result<void> write_record(const std::string& record);
  void append_topic(const McapTopic& topic);
  void close_chunk();
  void clear_chunk();

  // The summary (mcap_summary.cpp).
  std::string summary(std::uint64_t start) const;
  std::string statistics() const;
  std::string chunk_indexes() const;
  std::string chunk_index(const ChunkPlace& place) const;
  std::string places_of_message_indexes(const ChunkPlace& place) const;

  std::string path_;
  FileDescriptor file_;
  std::uint64_t end_ = 0;  ///< bytes of the file that are whole
  std::string schemas_, channel_records_;
  std::map<std::string, std::uint16_t> schema_of_;  ///< by type
  std::vector<Channel> channels_;

  std::string chunk_;        ///< waiting; its head is not yet filled in
  ChunkPlace waiting_;       ///< of it
  std::size_t message_ = 0;  ///< where the message in work begins
  bool has_messages_ = false;

  std::deque<ChunkPlace> chunks_;
  std::string attachment_indexes_, metadata_indexes_;
  std::uint32_t attachments_ = 0, metadata_ = 0;
};

}  // namespace fbvins
