// SPDX-License-Identifier: Apache-2.0
// Writer and reader of MCAP against each other, and against files that are cut off or damaged. Third-party readers are
// tried in tests/flight_record_by_others.py.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <utility>

#include "fbvins/io/file_source.hpp"
#include "fbvins/io/mcap_reader.hpp"
#include "fbvins/io/mcap_recover.hpp"
#include "fbvins/io/mcap_writer.hpp"
#include "fbvins/io/rosbag2_folder.hpp"

namespace fbvins {
namespace mcap_test {

/// While it lives, something looks at the file in the middle of each long pwrite() of this process and behind each one.
class WatchedWrites {
 public:
  explicit WatchedWrites(std::function<void()> look) { look_ = std::move(look); }
  ~WatchedWrites() { look_ = nullptr; }
  WatchedWrites(const WatchedWrites&) = delete;
  WatchedWrites& operator=(const WatchedWrites&) = delete;

  static ssize_t write(int fd, const void* bytes, std::size_t size, off_t offset) {
    using Write = ssize_t (*)(int, const void*, std::size_t, off_t);
    static const auto really = reinterpret_cast<Write>(::dlsym(RTLD_NEXT, "pwrite"));
    if (look_ && size > kLong_bytes) size /= 2;  // the caller goes on with the rest
    const ssize_t done = really(fd, bytes, size, offset);
    if (look_) look_();
    return done;
  }

 private:
  static constexpr std::size_t kLong_bytes = 60;
  static inline std::function<void()> look_;
};

namespace fs = std::filesystem;

const std::vector<McapTopic> kTopics = {{"/a", "x_msgs/msg/A", "int32 a\n"}, {"/b", "x_msgs/msg/B", "int32 b\n"}};

/// An end of the data, a footer and the magic behind what a writer that was killed has written.
constexpr std::size_t kProvisionalEnd_bytes = 9 + 4 + 9 + 20 + 8;

struct Said {
  std::string topic, data;
  std::int64_t t_ns = 0;
  std::uint64_t end = 0;  ///< of the message in the file
  bool operator==(const Said& o) const { return topic == o.topic && data == o.data && t_ns == o.t_ns; }
};

class Mcap : public ::testing::Test {
 protected:
  Mcap() { fs::create_directories(folder_); }
  ~Mcap() override { fs::remove_all(folder_); }

  McapWriter create() {
    auto file = McapWriter::create(path_, {"ros2", "a test"}, kTopics);
    EXPECT_TRUE(file) << file.error().message;
    return *std::move(file);
  }

  Said say(McapWriter& file, int number) {
    const std::size_t topic = number % 3 == 0;
    const Said said{kTopics[topic].topic, std::string(static_cast<std::size_t>(number % 17), static_cast<char>(number)),
                    1000 + number};
    file.begin_message(topic, Time{said.t_ns}) += said.data;
    file.end_message();
    return said;
  }

  /// Three chunks of ten messages.
  std::vector<Said> write_thirty(bool finished) {
    McapWriter file = create();
    std::vector<Said> all;
    EXPECT_TRUE(file.attach("note.txt", "text/plain", "hello"));
    EXPECT_TRUE(file.add_metadata("about", {{"key", "value"}}));
    for (int i = 0; i < 30; ++i) {
      all.push_back(say(file, i));
      if (i % 10 == 9) {
        EXPECT_TRUE(file.flush());
      }
    }
    if (finished) {
      EXPECT_TRUE(file.finish());
    }
    return all;
  }

  std::string bytes() const { return *read_file(path_, 1u << 20u); }

  const std::string folder_ = ::testing::TempDir() + "/fbvins_mcap_" + std::to_string(getpid());
  const std::string path_ = folder_ + "/a.mcap";
};

std::vector<Said> read_all(McapReader& reader) {
  std::vector<Said> out;
  while (const auto m = reader.next())
    out.push_back({m->channel->topic, std::string(m->data), m->log_time.ns, m->offset + m->data.size()});
  EXPECT_FALSE(reader.next()) << "the end stays the end";
  return out;
}

McapReader reader_of(const std::string& bytes) {
  auto reader = McapReader::open(bytes_in_memory(bytes), "a.mcap");
  EXPECT_TRUE(reader) << reader.error().message;
  return *std::move(reader);
}

TEST_F(Mcap, WhatIsWrittenIsReadInItsOrder) {
  const std::vector<Said> said = write_thirty(true);
  McapReader reader = reader_of(bytes());
  EXPECT_EQ(read_all(reader), said);
  EXPECT_FALSE(reader.damage().ends_early);
  EXPECT_EQ(reader.damage().parts, 0) << reader.damage().first;
  ASSERT_EQ(reader.attachments().size(), 1u);
  EXPECT_EQ(reader.attachments()[0].name, "note.txt");
  EXPECT_EQ(reader.attachments()[0].data, "hello");
}

TEST_F(Mcap, AFileThatIsCutAnywhereIsReadUpToItsLastWholeMessage) {
  const std::vector<Said> said = write_thirty(true);
  const std::string whole = bytes();
  McapReader all = reader_of(whole);
  const std::vector<Said> places = read_all(all);
  const std::uint64_t data_end = all.damage().end;
  for (std::size_t size = kMcapMagic.size(); size < whole.size(); ++size) {
    McapReader reader = reader_of(whole.substr(0, size));
    const std::vector<Said> read = read_all(reader);
    const auto expected = std::count_if(places.begin(), places.end(), [&](const Said& m) { return m.end <= size; });
    ASSERT_EQ(std::ssize(read), expected) << "cut at " << size;
    ASSERT_TRUE(std::equal(read.begin(), read.end(), said.begin()));
    ASSERT_EQ(reader.damage().ends_early, size < data_end + kMcapRecordHead_bytes) << "cut at " << size;
    ASSERT_EQ(reader.damage().parts, 0) << reader.damage().first;
  }
}

/// Programs that insist on an end read it: the last bytes are a footer without a summary, and the magic.
TEST_F(Mcap, AFileWhoseWriterWasKilledHasAnEnd) {
  const std::vector<Said> said = write_thirty(false);
  const std::string killed = bytes();
  EXPECT_TRUE(killed.ends_with(kMcapMagic));
  McapReader reader = reader_of(killed);
  EXPECT_EQ(read_all(reader), said);
  EXPECT_TRUE(reader.damage().no_summary);
  EXPECT_EQ(reader.damage().parts, 0) << reader.damage().first;
  fs::remove(path_);
  write_thirty(true);
  McapReader whole = reader_of(bytes());
  (void)read_all(whole);
  EXPECT_FALSE(whole.damage().no_summary);
}

/// Whatever write the process dies in, large ones also half done: the file has an end, and all earlier chunks.
TEST_F(Mcap, AFileHasAnEndBetweenAnyTwoWrites) {
  McapWriter file = create();
  std::vector<Said> said, written;
  std::size_t longest = 0;
  int looks = 0;
  const auto look = [&] {
    ++looks;
    const std::string now = bytes();
    ASSERT_TRUE(now.ends_with(kMcapMagic)) << "look " << looks;
    McapReader reader = reader_of(now);
    const std::vector<Said> read = read_all(reader);
    ASSERT_TRUE(read == written || read == said) << "look " << looks << ": " << read.size();
    ASSERT_FALSE(reader.damage().ends_early);
    ASSERT_EQ(reader.damage().parts, 0) << reader.damage().first;
    longest = std::max(longest, now.size());
  };
  for (int chunk = 0; chunk < 3; ++chunk) {
    for (int i = 0; i < 10; ++i) said.push_back(say(file, 10 * chunk + i));
    const WatchedWrites watched(look);
    ASSERT_TRUE(file.flush());
    written = said;
  }
  const WatchedWrites watched(look);
  ASSERT_TRUE(file.finish());
  look();
  EXPECT_GE(looks, 4 * 4) << "writes were not seen";
  EXPECT_EQ(longest, bytes().size());
}

TEST_F(Mcap, RecoveredFilesAreWhole) {
  const std::vector<Said> said = write_thirty(false);
  const std::string again = folder_ + "/again.mcap";
  const auto done = recover_mcap(path_, again);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->messages, 30);
  EXPECT_TRUE(done->was_cut_off);
  McapReader reader = reader_of(*read_file(again, 1u << 20u));
  EXPECT_EQ(read_all(reader), said);
  EXPECT_FALSE(reader.damage().no_summary);
  EXPECT_EQ(reader.channels().at(1).definition, "int32 a\n");
  ASSERT_EQ(reader.attachments().size(), 1u);
  EXPECT_EQ(reader.attachments()[0].media_type, "text/plain");
  ASSERT_EQ(reader.metadata().size(), 1u);
  EXPECT_EQ(reader.metadata()[0].values.at("key"), "value");
  EXPECT_EQ(recover_mcap(path_, again).error().message, again + ": exists already, and a record is never overwritten");
  const auto part = recover_mcap(path_, folder_ + "/part.mcap", {Time{1010}, Time{1015}});
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ(part->messages, 5);
}

TEST_F(Mcap, TopicsGetOtherNames) {
  write_thirty(true);
  const std::string out = folder_ + "/named.mcap";
  const auto done = recover_mcap(path_, out, {.names = {{kTopics[0].topic, "/other"}}});
  ASSERT_TRUE(done) << done.error().message;
  ASSERT_EQ(done->topics.size(), 2u);
  EXPECT_EQ(done->topics[0].messages + done->topics[1].messages, 30);
  EXPECT_EQ(done->first.ns, 1000);
  EXPECT_EQ(done->last.ns, 1029);
  McapReader reader = reader_of(*read_file(out, 1u << 20u));
  for (const Said& said : read_all(reader)) EXPECT_TRUE(said.topic == "/other" || said.topic == kTopics[1].topic) << said.topic;
  const auto refused = [&](const std::map<std::string, std::string>& names) {
    return recover_mcap(path_, folder_ + "/no.mcap", {.names = names}).error().message;
  };
  EXPECT_EQ(refused({{"/nope", "/a"}}), path_ + ": has no topic '/nope'");
  EXPECT_EQ(refused({{kTopics[0].topic, kTopics[1].topic}}), path_ + ": two topics would be '" + kTopics[1].topic + "'");
  EXPECT_FALSE(fs::exists(folder_ + "/no.mcap"));
}

TEST_F(Mcap, AFolderOfRosbag2HasItsMetadata) {
  write_thirty(true);
  const std::string out = folder_ + "/a \"bag\"";
  const auto done = write_rosbag2(path_, out + "/");
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_TRUE(fs::exists(out + "/a \"bag\"_0.mcap"));
  const std::string metadata = *read_file(out + "/metadata.yaml", 1u << 20u);
  for (const char* line : {"version: 5", "storage_identifier: mcap", "message_count: 30\n  topics",
                           "nanoseconds_since_epoch: 1000\n", "duration:\n    nanoseconds: 29\n", "- \"a \\\"bag\\\"_0.mcap\""})
    EXPECT_NE(metadata.find(line), std::string::npos) << line << "\n" << metadata;
  EXPECT_EQ(write_rosbag2(path_, out).error().message, out + ": exists already");
  EXPECT_FALSE(write_rosbag2(path_, folder_ + "/none/below"));
  EXPECT_FALSE(write_rosbag2(folder_ + "/nothing.mcap", folder_ + "/of_nothing"));
  EXPECT_FALSE(fs::exists(folder_ + "/of_nothing")) << "nothing is left of what failed";
}

TEST_F(Mcap, NothingWaitsInMemoryAfterFlush) {
  McapWriter file = create();
  std::vector<Said> said;
  for (int i = 0; i < 5; ++i) {
    said.push_back(say(file, i));
    ASSERT_TRUE(file.flush());
    McapReader reader = reader_of(bytes());
    EXPECT_EQ(read_all(reader), said) << "while the writer is still there";
  }
}

TEST_F(Mcap, ADamagedChunkIsLeftOutAndNamed) {
  const std::vector<Said> said = write_thirty(true);
  std::string damaged = bytes();
  McapReader all = reader_of(damaged);
  const std::vector<Said> places = read_all(all);
  damaged[places[14].end - 1] ^= 1;
  McapReader reader = reader_of(damaged);
  const std::vector<Said> read = read_all(reader);
  ASSERT_EQ(read.size(), 20u);
  EXPECT_EQ(read[9], said[9]);
  EXPECT_EQ(read[10], said[20]);
  EXPECT_EQ(reader.damage().parts, 1);
  EXPECT_TRUE(reader.damage().first.starts_with("a.mcap: byte ")) << reader.damage().first;
  EXPECT_TRUE(reader.damage().first.ends_with(": this chunk's checksum is wrong")) << reader.damage().first;
}

TEST_F(Mcap, AChunkTooLargeToLoadIsLeftOutAndNamedOnce) {
  const std::vector<Said> said = write_thirty(false);
  constexpr std::uint64_t kRecords = std::uint64_t{300} << 20u;
  std::string head;
  append_le(head, static_cast<std::uint8_t>(McapRecord::chunk));
  append_le(head, std::uint64_t{8 + 8 + 8 + 4 + 4 + 8 + kRecords});
  head.append(8 + 8 + 8, '\0');           // stamps, size when unpacked
  append_le(head, std::uint32_t{12345});  // a checksum
  append_mcap_text(head, "");
  append_le(head, kRecords);
  fs::resize_file(path_, fs::file_size(path_) - kProvisionalEnd_bytes);
  std::ofstream(path_, std::ios::binary | std::ios::app) << head;
  fs::resize_file(path_, fs::file_size(path_) + kRecords);  // takes no space on the disk
  auto reader = McapReader::open(*open_bytes(path_), "a.mcap");
  ASSERT_TRUE(reader);
  EXPECT_EQ(read_all(*reader), said);
  EXPECT_EQ(reader->damage().parts, 1);
  EXPECT_TRUE(reader->damage().first.ends_with(" bytes in one piece are too many")) << reader->damage().first;
}

TEST_F(Mcap, ZerosAtTheEndAreNoMessages) {
  const std::vector<Said> said = write_thirty(false);
  McapReader reader = reader_of(bytes().substr(0, bytes().size() - kProvisionalEnd_bytes) + std::string(5000, '\0'));
  EXPECT_EQ(read_all(reader), said);
  EXPECT_EQ(reader.damage().parts, 1);
  EXPECT_TRUE(reader.damage().ends_early);
}

TEST_F(Mcap, CompressedChunksAreRefusedByName) {
  std::string file(kMcapMagic);
  const std::size_t start = begin_mcap_record(file, McapRecord::chunk);
  file.append(8 + 8 + 8 + 4, '\0');
  append_mcap_text(file, "zstd");
  append_le(file, std::uint64_t{3});
  file += "abc";
  end_mcap_record(file, start);
  McapReader reader = reader_of(file);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.damage().first, "a.mcap: byte 17: this chunk is compressed by 'zstd', and only uncompressed ones are read");
}

TEST_F(Mcap, WhatIsNoMcapIsRefused) {
  for (const char* text : {"", "hello", "\x89PNG\r\n\x1a\n"}) {
    const auto reader = McapReader::open(bytes_in_memory(text), "a.mcap");
    ASSERT_FALSE(reader);
    EXPECT_EQ(reader.error().message, "a.mcap: does not begin as an MCAP file does");
  }
}

TEST_F(Mcap, ARecordIsNeverWrittenOver) {
  write_thirty(true);
  const auto second = McapWriter::create(path_, {"ros2", "a test"}, kTopics);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message, path_ + ": exists already, and a record is never overwritten");
  EXPECT_FALSE(McapWriter::create(folder_ + "/nowhere/a.mcap", {"ros2", "a test"}, kTopics));
}

/// A limit on the size of files stands for a disk that is full, and then has room again.
TEST_F(Mcap, AFullDiskCostsOnlyWhatDidNotFit) {
  McapWriter file = create();
  std::vector<Said> said = {say(file, 1)};
  ASSERT_TRUE(file.flush());
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  rlimit full = before;
  full.rlim_cur = bytes().size() + 40;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  say(file, 2);
  const auto refused = file.flush();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, path_ + ": writing failed (File too large)");
  EXPECT_TRUE(bytes().ends_with(kMcapMagic));
  said.push_back(say(file, 3));
  ASSERT_TRUE(file.finish());
  McapReader reader = reader_of(bytes());
  EXPECT_EQ(read_all(reader), said);
  EXPECT_EQ(reader.damage().parts, 0) << reader.damage().first;
}

}  // namespace mcap_test
}  // namespace fbvins

extern "C" ssize_t pwrite(int fd, const void* bytes, size_t size, off_t offset) {
  return fbvins::mcap_test::WatchedWrites::write(fd, bytes, size, offset);
}
