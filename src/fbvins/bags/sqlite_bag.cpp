// SPDX-License-Identifier: Apache-2.0
// ROS 2 bags in SQLite: a table of topics and one of messages in each file; messages may be compressed one by one.
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <memory>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/bags/decompress.hpp"
#include "fbvins/bags/whole_pages.hpp"

namespace fbvins {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct EndStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, EndStatement>;

Statement prepare(sqlite3* database, const char* query) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, query, -1, &statement, nullptr);
  return Statement(statement);
}

std::string text_of(sqlite3_stmt* statement, int column) {
  const auto* text = sqlite3_column_text(statement, column);
  return text == nullptr ? "" : std::string(reinterpret_cast<const char*>(text));
}

std::string_view bytes_of(sqlite3_stmt* statement, int column) {
  const void* bytes = sqlite3_column_blob(statement, column);
  return bytes == nullptr ? std::string_view()
                          : std::string_view(static_cast<const char*>(bytes),
                                             static_cast<std::size_t>(sqlite3_column_bytes(statement, column)));
}

struct File {
  std::string path;
  Database database;
  Statement again;                             ///< a message by its row
  std::map<std::int64_t, std::size_t> topics;  ///< by their number in this file
};

class SqliteBag final : public BagReader {
 public:
  SqliteBag(std::vector<File> files, bool zstd_messages) : files_(std::move(files)), packed_(zstd_messages) {}

  Result<void> read_topics() {
    for (File& file : files_) {
      const Statement topics =
          prepare(file.database.get(), "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
      file.again = prepare(file.database.get(), "SELECT data FROM messages WHERE id = ?");
      if (!topics || !file.again)
        return Error{ErrorCode::malformed,
                     fmt::format("{}: is no ROS 2 bag: {}", file.path, sqlite3_errmsg(file.database.get()))};
      while (sqlite3_step(topics.get()) == SQLITE_ROW)
        if (text_of(topics.get(), 3) == "cdr")
          file.topics[sqlite3_column_int64(topics.get(), 0)] =
              number_of({text_of(topics.get(), 1), plain_type(text_of(topics.get(), 2)), Encoding::cdr});
    }
    return {};
  }

  std::string format() const override { return "ROS 2 bag (SQLite)"; }

  std::string_view read(const MessagePlace& place) override {
    if (place.chunk >= files_.size()) return {};
    sqlite3_stmt* again = files_[place.chunk].again.get();
    sqlite3_reset(again);
    sqlite3_bind_int64(again, 1, static_cast<std::int64_t>(place.offset));
    if (sqlite3_step(again) != SQLITE_ROW) return {};
    const std::string_view bytes = bytes_of(again, 0);
    if (!packed_ && !is_zstd(bytes)) return bytes;
    read_ = unpack("zstd", bytes, 0, std::move(read_)).bytes;
    return read_;
  }

 protected:
  std::optional<BagMessage> advance() override {
    for (; at_ < files_.size(); ++at_, messages_.reset()) {
      File& file = files_[at_];
      // In the order of rows, which is that of writing: it needs no index, and a file that is cut off gives what comes before.
      const bool by_time = !messages_ && window();
      if (!messages_) messages_ = by_time ? messages_in_window(file) : all_messages(file);
      int state = messages_ ? sqlite3_step(messages_.get()) : SQLITE_ERROR;
      if (by_time && state != SQLITE_ROW && state != SQLITE_DONE) {  // the index of stamps is damaged
        messages_ = all_messages(file);
        state = messages_ ? sqlite3_step(messages_.get()) : SQLITE_ERROR;
      }
      for (; state == SQLITE_ROW; state = sqlite3_step(messages_.get()))
        if (auto message = message_of(file)) return message;
      if (state == SQLITE_DONE) continue;
      damage_.ends_early = true;
      complain(fmt::format("{}: {}", file.path, sqlite3_errmsg(file.database.get())));
    }
    return std::nullopt;
  }

 private:
  static Statement all_messages(const File& file) {
    return prepare(file.database.get(), "SELECT id, topic_id, timestamp, data FROM messages ORDER BY id");
  }

  Statement messages_in_window(const File& file) {
    if (!origin_ns_) {
      const Statement first = prepare(file.database.get(), "SELECT timestamp FROM messages ORDER BY id LIMIT 1");
      if (first && sqlite3_step(first.get()) == SQLITE_ROW) origin_ns_ = sqlite3_column_int64(first.get(), 0);
    }
    // The data of other rows, which lies on pages of its own, is not read.
    Statement some =
        prepare(file.database.get(),
                "SELECT id, topic_id, timestamp, data FROM messages WHERE timestamp BETWEEN ? AND ? OR topic_id IN "
                "(SELECT id FROM topics WHERE name LIKE '%tf_static') OR id IN (SELECT min(id) FROM messages GROUP BY "
                "topic_id) ORDER BY id");
    constexpr std::int64_t kFar_ns = std::int64_t{1} << 61;  // a sum of these still fits
    const auto bind = [&](int column, Duration since_origin) {
      const std::int64_t origin_ns = std::clamp(origin_ns_.value_or(0), -kFar_ns, kFar_ns);
      sqlite3_bind_int64(some.get(), column, origin_ns + std::clamp(since_origin.ns, -kFar_ns, kFar_ns));
    };
    if (some) bind(1, window()->from), bind(2, window()->to);
    return some;
  }

  std::optional<BagMessage> message_of(File& file) {
    const auto row = sqlite3_column_int64(messages_.get(), 0);
    const auto topic = file.topics.find(sqlite3_column_int64(messages_.get(), 1));
    if (topic == file.topics.end()) return std::nullopt;
    const Time t{sqlite3_column_int64(messages_.get(), 2)};
    std::string_view data = bytes_of(messages_.get(), 3);
    if (packed_ || is_zstd(data)) {
      Unpacked out = unpack("zstd", data, 0, std::move(unpacked_));
      unpacked_ = std::move(out.bytes);
      if (!out.whole) {
        complain(fmt::format("{}: the message in row {} cannot be unpacked", file.path, row));
        return std::nullopt;
      }
      data = unpacked_;
    }
    return BagMessage{topic->second, t, data, {at_, static_cast<std::uint64_t>(row), data.size()}};
  }

  std::vector<File> files_;
  bool packed_;
  std::size_t at_ = 0;
  Statement messages_;
  std::optional<std::int64_t> origin_ns_;  ///< of the first message
  std::string unpacked_, read_;            ///< the messages that next() and read() returned last
};

}  // namespace

Result<std::unique_ptr<BagReader>> open_sqlite_bag(const std::vector<std::string>& paths, bool zstd_messages) {
  std::vector<File> files;
  for (const std::string& path : paths) {
    sqlite3* database = nullptr;
    const int opened = sqlite3_open_v2(path.c_str(), &database, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, whole_pages_vfs());
    files.push_back({path, Database(database), {}, {}});
    // Otherwise SQLite refuses a file that is shorter than its header says.
    if (opened == SQLITE_OK) sqlite3_exec(database, "PRAGMA writable_schema = ON", nullptr, nullptr, nullptr);
    if (opened != SQLITE_OK) return Error{ErrorCode::unreadable, fmt::format("{}: {}", path, sqlite3_errmsg(database))};
  }
  auto bag = std::make_unique<SqliteBag>(std::move(files), zstd_messages);
  if (Result<void> done = bag->read_topics(); !done) return done.error();
  return std::unique_ptr<BagReader>(std::move(bag));
}

}  // namespace fbvins
