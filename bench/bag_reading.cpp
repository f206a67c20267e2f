// SPDX-License-Identifier: Apache-2.0
// CPU time and memory of reading a bag of raw stereo images (bench/bags runs it).
//
//   bag_reading make FOLDER SECONDS
//   bag_reading read FILE
//
// The first writes stereo images of 752 x 480 at 20 Hz and an IMU at 200 Hz in six formats; the second prints the CPU time
// for each stereo frame, from opening to the last image, and the peak memory.
#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/flight_record.hpp"
#include "tests/support/packed_bags.hpp"

namespace fbvins {
namespace {

constexpr int kImageRate_hz = 20, kReadingsPerImage = 10;
constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{4} << 30u;

int fail(const std::string& sentence) {
  fmt::print(stderr, "bag_reading: {}\n", sentence);
  return 2;
}

StereoRig rig() {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{458, 457, 376, 240, -0.28, 0.07, 0, 0}, 752, 480);
  rig.T_BC1.p.x() = 0.11;
  return rig;
}

/// A gradient with noise in the low bits, which compresses about as well as a real image.
std::shared_ptr<const Image> image(Rng& rng) {
  auto out = std::make_shared<Image>(752, 480);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 752; ++x) out->at(x, y) = static_cast<std::uint8_t>(x / 4 + y / 8 + static_cast<int>(rng.below(8)));
  return out;
}

template <class Writer>
Result<void> fill(Writer& writer, int seconds) {
  Rng rng(1);
  const auto a = image(rng), b = image(rng);
  for (int i = 0; i < seconds * kImageRate_hz * kReadingsPerImage; ++i) {
    const Time t{1'000'000'000 + 5'000'000 * static_cast<std::int64_t>(i)};
    if (auto done = writer.add(ImuSample{t, Vec3(0.1, 0, 0), Vec3(0, 9.81, 0)}); !done) return done;
    if (i % kReadingsPerImage == 5)
      if (auto done = writer.add(StereoFrame{t, i % 20 == 5 ? a : b, i % 20 == 5 ? b : a}); !done) return done;
    if constexpr (requires { writer.flush(); })
      if (i % 100 == 99)
        if (auto done = writer.flush(); !done) return done;
  }
  return writer.finish();
}

int make(const std::string& folder, int seconds) {
  std::filesystem::create_directories(folder);
  const auto path = [&](const char* name) { return folder + "/" + name; };
  auto bag = Ros1BagWriter::create(path("flight.bag"), rig(), Time{1'000'000'000});
  if (!bag) return fail(bag.error().message);
  if (auto done = fill(*bag, seconds); !done) return fail(done.error().message);
  auto record = FlightRecord::create(path("flight.mcap"), rig());
  if (!record) return fail(record.error().message);
  if (auto done = fill(*record, seconds); !done) return fail(done.error().message);
  const auto bytes = open_bytes(path("flight.mcap"));
  auto tables = read_mcap_bag(*bytes, path("flight.mcap"));
  if (!tables || !test::write_sqlite(path("flight.db3"), **tables, false)) return fail("flight.db3 cannot be written");
  std::ofstream(path("lz4.bag"), std::ios::binary)
      << test::packed_ros1(*read_file(path("flight.bag"), kLargestFile_bytes), "lz4");
  const std::string record_bytes = *read_file(path("flight.mcap"), kLargestFile_bytes);
  std::ofstream(path("plain.mcap"), std::ios::binary) << test::packed_mcap(record_bytes, "");
  std::ofstream(path("zstd.mcap"), std::ios::binary) << test::packed_mcap(record_bytes, "zstd");
  return 0;
}

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

int read(const std::string& path) {
  const double start_s = cpu_s();
  RecordingOptions options;
  options.dataset.rig = rig();  // bags of other programs hold no calibration
  const auto data = open_recording(path, options);
  if (!data) return fail(data.error().message);
  const double opened_s = cpu_s();
  int frames = 0;
  while (const auto event = (*data)->next()) frames += std::holds_alternative<StereoFrame>(*event);
  const double end_s = cpu_s();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.1f} |\n", std::filesystem::path(path).filename().string(),
             std::filesystem::file_size(path) >> 20u, frames, 1e3 * (opened_s - start_s) / frames,
             1e3 * (end_s - opened_s) / frames, 1e3 * (end_s - start_s) / frames, static_cast<double>(usage.ru_maxrss) / 1024);
  return 0;
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "make" && argc == 4) return fbvins::make(argv[2], std::atoi(argv[3]));
  if (command == "read" && argc == 3) return fbvins::read(argv[2]);
  return fbvins::fail("usage: bag_reading make FOLDER SECONDS | bag_reading read FILE");
}
