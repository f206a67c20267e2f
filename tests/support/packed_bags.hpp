// SPDX-License-Identifier: Apache-2.0
// For tests: compresses the chunks of bags whose chunks are plain. The offsets in their indexes at the end are wrong then; no
// reader here uses them.
#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zstd.h>

#include <string>
#include <string_view>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/io/little_endian.hpp"
#include "fbvins/io/mcap_format.hpp"

namespace fbvins::test {

inline std::string packed(std::string_view compression, std::string_view bytes) {
  std::string out;
  if (compression.empty()) {
    out = bytes;
  } else if (compression == "lz4") {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
  } else if (compression == "zstd") {
    out.resize(ZSTD_compressBound(bytes.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1));
  } else {
    auto length = static_cast<unsigned>(bytes.size() + bytes.size() / 100 + 600);
    out.resize(length);
    BZ2_bzBuffToBuffCompress(out.data(), &length, const_cast<char*>(bytes.data()), static_cast<unsigned>(bytes.size()), 1, 0, 0);
    out.resize(length);
  }
  return out;
}

/// A ROS 1 bag, its chunks compressed by lz4 or bz2.
inline std::string packed_ros1(std::string_view bag, const std::string& compression) {
  constexpr std::size_t kMagic_bytes = 13;
  std::string out(bag.substr(0, kMagic_bytes));
  const auto field = [](std::string& header, std::string_view name, std::string_view value) {
    append_le(header, static_cast<std::uint32_t>(name.size() + 1 + value.size()));
    header.append(name).append("=").append(value);
  };
  const auto piece = [&](std::string_view bytes) {
    append_le(out, static_cast<std::uint32_t>(bytes.size()));
    out.append(bytes);
  };
  for (ByteCursor in(bag.substr(kMagic_bytes)); in.left() > 0;) {
    const std::string_view header = in.take(in.get<std::uint32_t>()), data = in.take(in.get<std::uint32_t>());
    if (header.find("compression=") == std::string_view::npos) {
      piece(header), piece(data);
      continue;
    }
    std::string size, chunk;
    append_le(size, static_cast<std::uint32_t>(data.size()));
    field(chunk, "op", "\x05"), field(chunk, "compression", compression), field(chunk, "size", size);
    piece(chunk), piece(packed(compression, data));
  }
  return out;
}

/// An MCAP file without attachments, its chunks compressed by lz4 or zstd.
inline std::string packed_mcap(std::string_view file, std::string_view compression) {
  std::string out(kMcapMagic);
  for (ByteCursor in(file.substr(kMcapMagic.size())); in.left() > kMcapRecordHead_bytes;) {
    const auto kind = static_cast<McapRecord>(in.get<std::uint8_t>());
    const std::string_view content = in.take(in.get<std::uint64_t>());
    if (kind == McapRecord::attachment) continue;  // a flight record is recognised by them
    const std::size_t record = begin_mcap_record(out, kind);
    if (kind == McapRecord::chunk) {
      constexpr std::size_t kBeforeCompression_bytes = 8 + 8 + 8 + 4, kBeforeRecords_bytes = kBeforeCompression_bytes + 4 + 8;
      const std::string records = packed(compression, content.substr(kBeforeRecords_bytes));
      out.append(content.substr(0, kBeforeCompression_bytes));
      append_mcap_text(out, compression);
      append_le(out, static_cast<std::uint64_t>(records.size()));
      out.append(records);
    } else {
      out.append(content);
    }
    end_mcap_record(out, record);
  }
  return out.append(kMcapMagic);
}

/// A bag as rosbag2 keeps it in tables, its messages plain or compressed by zstd. False on any failure.
inline bool write_sqlite(const std::string& path, BagReader& bag, bool packed_messages) {
  sqlite3* database = nullptr;
  bool good = sqlite3_open(path.c_str(), &database) == SQLITE_OK;
  const auto run = [&](const char* sql) { good &= sqlite3_exec(database, sql, nullptr, nullptr, nullptr) == SQLITE_OK; };
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
      "CREATE INDEX timestamp_idx ON messages (timestamp ASC); BEGIN");
  sqlite3_stmt *row = nullptr, *topic = nullptr;
  sqlite3_prepare_v2(database, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", -1, &row, nullptr);
  sqlite3_prepare_v2(database, "INSERT INTO topics VALUES(?, ?, ?, 'cdr')", -1, &topic, nullptr);
  std::size_t topics = 0;
  while (const auto message = bag.next()) {
    for (; topics < bag.topics().size(); ++topics) {
      const BagTopic& about = bag.topics()[topics];
      sqlite3_reset(topic);
      sqlite3_bind_int64(topic, 1, static_cast<std::int64_t>(topics));
      sqlite3_bind_text(topic, 2, about.name.c_str(), -1, SQLITE_TRANSIENT);
      sqlite3_bind_text(topic, 3, about.type.c_str(), -1, SQLITE_TRANSIENT);
      good &= sqlite3_step(topic) == SQLITE_DONE;
    }
    const std::string data = packed_messages ? packed("zstd", message->data) : std::string(message->data);
    sqlite3_reset(row);
    sqlite3_bind_int64(row, 1, static_cast<std::int64_t>(message->topic));
    sqlite3_bind_int64(row, 2, message->log_time.ns);
    sqlite3_bind_blob(row, 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    good &= sqlite3_step(row) == SQLITE_DONE;
  }
  run("COMMIT");
  sqlite3_finalize(row);
  sqlite3_finalize(topic);
  sqlite3_close(database);
  return good;
}

}  // namespace fbvins::test
