// SPDX-License-Identifier: Apache-2.0
// Bags of each format cut off anywhere, and parts of them picked by time.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/decompress.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/io/flight_record.hpp"
#include "tests/support/packed_bags.hpp"

namespace fbvins {
namespace cut_bags_test {

namespace fs = std::filesystem;

constexpr int kReadings = 800;       // of the recordings that are cut, in four seconds
constexpr int kLongReadings = 2000;  // of those that parts are picked of, in ten
constexpr int kTinyReadings = 200;   // of the one for bz2, which is slow
constexpr int kReadingsPerFrame = 10;
constexpr std::int64_t kStart_ns = 1'000'000'000, kReading_ns = 5'000'000;

StereoRig rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{90, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, 80, 60), {}});
  rig.cameras[1].T_BC = {Quat::Identity(), {0.1, 0, 0}};
  return rig;
}

/// Noise, which no compression makes small.
std::shared_ptr<const Image> image(Rng& rng) {
  auto out = std::make_shared<Image>(80, 60);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) out->at(x, y) = static_cast<std::uint8_t>(rng.below(256));
  return out;
}

template <class Writer>
void fill(Writer& writer, int readings) {
  Rng rng(8);
  for (int i = 0; i < readings; ++i) {
    const Time t{kStart_ns + kReading_ns * static_cast<std::int64_t>(i)};
    ASSERT_TRUE(writer.add(ImuSample{t, Vec3(0.1, 0, 1e-9 * i), Vec3(0, 9.81, i)}));
    if (i % kReadingsPerFrame == 5) {
      const auto left = image(rng), right = image(rng);
      ASSERT_TRUE(writer.add(StereoFrame{t, {left, right}}));
    }
    if constexpr (requires { writer.flush(); }) {  // ends a chunk
      if (i % 100 == 99) {
        ASSERT_TRUE(writer.flush());
      }
    }
  }
  ASSERT_TRUE(writer.finish());
}

std::string bytes_of(const fs::path& file) {
  std::ostringstream out;
  out << std::ifstream(file, std::ios::binary).rdbuf();
  return out.str();
}

/// One folder and one copy of each recording for all tests of this file.
class Files {
 public:
  Files() : folder_(fs::temp_directory_path() / ("fbvins_cut_bags_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    write("short", kReadings);
    write("long", kLongReadings);
    write("tiny", kTinyReadings);
    ros1 = bytes_of(path("short.bag"));
    mcap = bytes_of(path("short.mcap"));
  }
  ~Files() { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::string ros1, mcap;

 private:
  void write(const std::string& name, int readings) const {
    auto bag = Ros1BagWriter::create(path(name + ".bag"), rig(), Time{kStart_ns});
    if (bag) fill(*bag, readings);
    // A flight record is an MCAP file of ROS 2's messages.
    auto record = FlightRecord::create(path(name + ".mcap"), rig());
    if (record) fill(*record, readings);
  }

  fs::path folder_;
};

const Files& files() {
  static const Files all;
  return all;
}

/// The flight as rosbag2 keeps it.
void write_sqlite(const std::string& path, const std::string& mcap, bool packed_messages) {
  fs::remove(path);
  auto bag = read_mcap_bag(bytes_in_memory(mcap), "flight.mcap");
  ASSERT_TRUE(bag && test::write_sqlite(path, **bag, packed_messages));
}

using Open = std::function<Result<std::unique_ptr<BagReader>>(const std::string& bytes)>;

Result<std::unique_ptr<BagReader>> open_ros1(const std::string& bytes) {
  return read_ros1_bag(bytes_in_memory(bytes), "cut.bag");
}
Result<std::unique_ptr<BagReader>> open_mcap(const std::string& bytes) {
  return read_mcap_bag(bytes_in_memory(bytes), "cut.mcap");
}
template <bool packed_messages>
Result<std::unique_ptr<BagReader>> open_sqlite(const std::string& bytes) {
  const std::string path = files().path("cut.db3");
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  return open_sqlite_bag({path}, packed_messages);
}

std::size_t readings_of(const BagContents& contents) {
  std::size_t count = 0;
  for (const auto& [name, topic] : contents.imu) count += topic.samples.size();
  return count;
}

/// Reads the beginning of a recording: it has no reading that the whole one lacks, and each image listed can be decoded.
std::size_t read_beginning(BagReader& bag) {
  const BagContents contents = read_contents(bag);
  for (const auto& [name, topic] : contents.imu)
    for (std::size_t i = 0; i < topic.samples.size(); ++i) EXPECT_EQ(topic.samples[i].accel_mps2.z(), static_cast<double>(i));
  for (const auto& [name, topic] : contents.images)
    for (const ImageRow& row : topic.rows)
      EXPECT_TRUE(image_of(bag.read(place_of(row.file)), topic.encoding, topic.compressed)) << row.file;
  return readings_of(contents);
}

/// `lost`: most readings that may be lost with the chunk or record that is cut. None for SQLite: a file of linked pages that is
/// cut off guarantees no share.
void expect_beginnings(const char* name, const std::string& whole, const Open& open, std::optional<std::size_t> lost,
                       std::size_t all_readings = kReadings) {
  Rng rng(1, 2);
  int opened = 0;
  for (int i = 0; i < 200; ++i) {
    const auto length = static_cast<std::size_t>(rng.uniform() * static_cast<double>(whole.size()));
    auto bag = open(whole.substr(0, length));
    if (!bag) {
      EXPECT_EQ(bag.error().message.find('\n'), std::string::npos);
      continue;
    }
    ++opened;
    const std::size_t readings = read_beginning(**bag);
    EXPECT_LE(readings, all_readings) << name << ' ' << length;
    if (!lost) continue;
    EXPECT_TRUE((*bag)->damage().ends_early || readings == all_readings) << name << ' ' << length;  // what is behind is an index
    EXPECT_GE(readings + *lost, all_readings * length / whole.size()) << name << ' ' << length;
  }
  EXPECT_GT(opened, lost ? 190 : 100) << name;
  auto all = open(whole);
  ASSERT_TRUE(all) << name;
  EXPECT_EQ(read_beginning(**all), all_readings) << name;
}

// Of a chunk compressed in blocks only complete blocks are decompressed; a ROS 1 bag's chunk holds half of the recording.
constexpr std::size_t kRos1Chunk_readings = 3 * kReadings / 4, kMcapChunk_readings = 200;

TEST(CutBags, Ros1) { expect_beginnings("plain", files().ros1, open_ros1, 60); }
TEST(CutBags, Ros1WithLz4) { expect_beginnings("lz4", test::packed_ros1(files().ros1, "lz4"), open_ros1, kRos1Chunk_readings); }
TEST(CutBags, Ros1WithBz2) {
  expect_beginnings("bz2", test::packed_ros1(bytes_of(files().path("tiny.bag")), "bz2"), open_ros1, kTinyReadings, kTinyReadings);
}
/// Kilobytes of chunks that unpack to gigabytes.
TEST(CutBags, ABagThatUnpacksToAThousandTimesItsSizeIsLeftOut) {
  std::string bag = "#ROSBAG V2.0\n";
  const std::string zeros(std::size_t{15} << 20u, '\0');
  const auto piece = [&](const std::string& bytes) {
    append_le(bag, static_cast<std::uint32_t>(bytes.size()));
    bag += bytes;
  };
  std::string size, header;
  append_le(size, static_cast<std::uint32_t>(zeros.size()));
  for (const auto& [name, value] : {std::pair<std::string, std::string>{"op", "\x05"}, {"compression", "bz2"}, {"size", size}}) {
    append_le(header, static_cast<std::uint32_t>(name.size() + 1 + value.size()));
    header += name + "=" + value;
  }
  const std::string chunk = test::packed("bz2", zeros);
  for (int i = 0; i < 100; ++i) piece(header), piece(chunk);
  ASSERT_LT(bag.size(), 50'000u);
  auto reader = open_ros1(bag);
  ASSERT_TRUE(reader);
  EXPECT_FALSE((*reader)->next());
  const BagDamage& damage = (*reader)->damage();
  EXPECT_LT(damage.parts, 12) << "chunks that were unpacked, and the sentence";
  const Unpacked one = unpack("bz2", test::packed("bz2", std::string(std::size_t{40} << 20u, '\0')), 40u << 20u);
  EXPECT_TRUE(one.bytes.empty());
  EXPECT_FALSE(one.whole);
}

TEST(CutBags, Mcap) { expect_beginnings("plain", files().mcap, open_mcap, 60); }
TEST(CutBags, McapWithLz4) { expect_beginnings("lz4", test::packed_mcap(files().mcap, "lz4"), open_mcap, kMcapChunk_readings); }
TEST(CutBags, McapWithZstd) {
  expect_beginnings("zstd", test::packed_mcap(files().mcap, "zstd"), open_mcap, kMcapChunk_readings);
}
TEST(CutBags, Sqlite) {
  write_sqlite(files().path("flight.db3"), files().mcap, false);
  expect_beginnings("sqlite", bytes_of(files().path("flight.db3")), open_sqlite<false>, std::nullopt);
}
TEST(CutBags, SqliteWithZstd) {
  write_sqlite(files().path("packed.db3"), files().mcap, true);
  expect_beginnings("sqlite zstd", bytes_of(files().path("packed.db3")), open_sqlite<true>, std::nullopt);
}

/// Counts the bytes read from it.
class CountedBytes final : public ByteSource {
 public:
  CountedBytes(std::string bytes, std::uint64_t& count) : bytes_(bytes_in_memory(std::move(bytes))), count_(&count) {}
  std::uint64_t size() const override { return bytes_->size(); }
  void fill(std::string& out, std::uint64_t offset, std::uint64_t count) const override {
    bytes_->fill(out, offset, count);
    *count_ += out.size();
  }

 private:
  std::shared_ptr<ByteSource> bytes_;
  std::uint64_t* count_;
};

/// Of 10 s the three from the sixth on, and the first message of each topic.
void expect_part(const char* name, BagReader& part, BagReader& whole) {
  part.only({6'000'000'000}, {9'000'000'000});
  const BagContents some = read_contents(part), all = read_contents(whole);
  const auto inside = [](Time t, Time first) {
    return t - first >= Duration{6'000'000'000} && t - first < Duration{9'000'000'000};
  };
  ASSERT_EQ(some.images.size(), all.images.size()) << name;
  EXPECT_EQ(some.cameras.size(), all.cameras.size()) << name;
  EXPECT_EQ(some.transforms.size(), all.transforms.size()) << name;
  const Time first{kStart_ns};
  for (const auto& [topic, images] : all.images) {
    std::vector<std::string> expected, got;
    for (const ImageRow& row : images.rows)
      if (&row == &images.rows.front() || inside(row.t, first)) expected.push_back(row.file);
    for (const ImageRow& row : some.images.at(topic).rows) got.push_back(row.file);
    EXPECT_EQ(got, expected) << name;
    EXPECT_EQ(got.size(), 61u) << name;
  }
  EXPECT_EQ(readings_of(some), 601u) << name;
}

TEST(PartsOfBags, ChunksOutsideAreNotRead) {
  for (const bool mcap : {false, true})
    for (const char* compression : {"", "lz4"}) {
      const std::string plain = bytes_of(files().path(mcap ? "long.mcap" : "long.bag"));
      const std::string bytes = *compression == '\0' ? plain
                                : mcap               ? test::packed_mcap(plain, compression)
                                                     : test::packed_ros1(plain, compression);
      for (const bool whole_file : {true, false}) {
        // Without its last tenth, and so without the index at the end.
        const std::string file = whole_file ? bytes : bytes.substr(0, bytes.size() / 10 * 9);
        const Open open = mcap ? open_mcap : open_ros1;
        std::uint64_t read = 0;
        auto source = std::make_shared<CountedBytes>(file, read);
        auto part = mcap ? read_mcap_bag(source, "part") : read_ros1_bag(source, "part");
        auto whole = open(file);
        ASSERT_TRUE(part && whole);
        expect_part(mcap ? "mcap" : "ros1", **part, **whole);
        EXPECT_LT(static_cast<double>(read), 0.85 * static_cast<double>(file.size())) << mcap << compression << whole_file;
      }
    }
}

TEST(PartsOfBags, RowsOutsideAreNotRead) {
  write_sqlite(files().path("part.db3"), bytes_of(files().path("long.mcap")), false);
  auto part = open_sqlite_bag({files().path("part.db3")}, false), whole = open_sqlite_bag({files().path("part.db3")}, false);
  ASSERT_TRUE(part && whole);
  expect_part("sqlite", **part, **whole);
}

TEST(PartsOfBags, ARecordingBeginsAndEndsWhereItIsAsked) {
  const RecordingOptions options{.dataset = {.start_s = 4, .duration_s = 2}};
  for (const char* name : {"long.bag", "long.mcap"}) {
    auto part = open_recording(files().path(name), options);
    ASSERT_TRUE(part) << part.error().message;
    EXPECT_EQ((*part)->info().frames, 40) << name;
    EXPECT_EQ((*part)->info().first_image.ns, kStart_ns + 5 * kReading_ns + 4'000'000'000) << name;
    std::optional<Time> first_reading, last_reading;
    while (const auto event = (*part)->next())
      if (const auto* sample = std::get_if<ImuSample>(&*event)) {
        if (!first_reading) first_reading = sample->t;
        last_reading = sample->t;
      }
    // A second of readings before the first frame, and none after the last one.
    EXPECT_EQ(first_reading->ns, (*part)->info().first_image.ns - 1'000'000'000) << name;
    EXPECT_LE(last_reading->ns, (*part)->info().last_image.ns + kReading_ns) << name;
  }
  EXPECT_EQ(open_recording(files().path("long.bag"), {.dataset = {.start_s = 60}}).error().message,
            files().path("long.bag") + ": no frames are left after 60 s");
}

}  // namespace cut_bags_test
}  // namespace fbvins
