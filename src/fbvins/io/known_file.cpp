// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/known_file.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/foreign_files.hpp"
#include "fbvins/io/imu_file.hpp"
#include "fbvins/io/kitti_poses.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;
using std::string_view;
using std::literals::operator""sv;

constexpr std::size_t kBeginning_bytes = 1u << 20u;
constexpr std::uint64_t kLargestText_bytes = std::uint64_t{1} << 28u;

struct Signature {
  string_view bytes;
  const char *what, *use;
};

constexpr const char
    *kImage = "an image",
    *kNoRecording = "a recording is a folder in EuRoC's layout or a bag: a single image is none",
    *kFlightLog = "it holds no images: poses of its messages can be compared once they are written as TUM's or EuRoC's rows";

constexpr Signature kSignatures[] = {
    {"FBVPLACE"sv, "a map", "give it by --load-map or --map; `fbvins map info` says what is in it"},
    {"FBVJOURN"sv, "the journal of a map", "it lies beside its map, and is read with that"},
    {"FBVWORDS"sv, "a vocabulary of visual words", "the environment's FBVINS_VOCABULARY names it"},
    {"ULog\x01\x12\x35"sv, "a log of PX4", kFlightLog},
    {"\xA3\x95\x80"sv, "a log of ArduPilot's dataflash", kFlightLog},
    {"\x89PNG"sv, kImage, kNoRecording},
    {"\xFF\xD8\xFF"sv, kImage, kNoRecording},
    {"P5\n"sv, kImage, kNoRecording},
    {"\x1A\x45\xDF\xA3"sv, "a film (Matroska)", "it has no stamps of its images and no IMU: record a bag"},
    {"ply\n"sv, "a cloud of points (PLY)", "it is no recording, and no map of this program"},
    {"# .PCD"sv, "a cloud of points (PCD)", "it is no recording, and no map of this program"},
    {"\x89HDF"sv, "a file of HDF5", "write what is in it as a folder in EuRoC's layout (docs/recordings.md)"},
    {"\x1F\x8B"sv, "an archive (gzip)", "unpack it; of archives only a zip of EuRoC's is read as it is"},
    {"7z\xBC\xAF"sv, "an archive (7z)", "unpack it; of archives only a zip of EuRoC's is read as it is"},
};

std::string beginning_of(const std::string& path) {
  std::string out(kBeginning_bytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(out.data(), static_cast<std::streamsize>(out.size()));
  out.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return out;
}

std::optional<KnownFile> by_bytes(const std::string& path, string_view bytes) {
  for (const Signature& s : kSignatures)
    if (bytes.starts_with(s.bytes)) return KnownFile{s.what, s.use};
  if (bytes.size() > 12 && bytes.substr(4, 4) == "ftyp")
    return KnownFile{"a film (MP4)", "it has no stamps of its images and no IMU: record a bag"};
  if (path.ends_with(".safetensors"))
    return KnownFile{"weights of a network", "give those of `boost` by frontend.boost.booster.weights"};
  if (path.ends_with(".tlog")) return KnownFile{"a telemetry log of MAVLink", kFlightLog};
  return std::nullopt;
}

/// Counts, and the time from the first to the last.
template <class Rows>
std::string span_of(const Rows& rows, const char* of) {
  return fmt::format("{} {} over {:.1f} s", rows.size(), of, rows.empty() ? 0.0 : (rows.back().t - rows.front().t).seconds());
}

std::optional<KnownFile> by_words(const std::string& path, const std::string& text) {
  if (text.find("ORB_SLAM") == std::string::npos && text.starts_with("10 6  0 0"))
    return KnownFile{"ORB-SLAM's vocabulary (DBoW2)", "this program has one of its own, which `fbvins vocab` trains"};
  if (text.find("\"result\"") != std::string::npos &&
      (text.find("\"timing\"") != std::string::npos || text.find("\"live\"") != std::string::npos))
    return KnownFile{"the summary of a run", "`fbvins report` shows the folder in which it lies"};
  if (text.starts_with("# camera ") || text.find("EKF2_") != std::string::npos)
    if (path.ends_with(".params"))
      return KnownFile{"parameters of a flight controller", "load them with its ground station (docs/px4.md)"};
  if (const std::string foreign = foreign_file(text); !foreign.empty()) {  // "this is WHAT: WHAT TO DO"
    const std::size_t colon = foreign.find(": ");
    return KnownFile{foreign.substr(8, colon - 8), foreign.substr(colon + 2)};
  }
  return std::nullopt;
}

/// The rows of an IMU, a list of images, or a trajectory.
std::optional<KnownFile> by_rows(const std::string& path, const std::string& text) {
  if (const auto images = read_image_rows(text, path); images)
    return KnownFile{span_of(images->rows, "images, listed as EuRoC's camN/data.csv does,"),
                     "the folder with cam0 and imu0 is the recording"};
  if (const auto imu = read_imu_csv(path); imu)
    return KnownFile{span_of(*imu, "readings of an IMU, as in EuRoC's imu0/data.csv,"),
                     "the folder with cam0 and imu0 is the recording"};
  if (const auto poses = read_trajectory(path); poses)
    return KnownFile{
        span_of(poses->points, "poses, a trajectory") + (poses->recognised.empty() ? "" : " (" + poses->recognised + ")"),
        "`fbvins eval`, `fbvins mocap` and `fbvins report --truth` read it"};
  if (looks_like_kitti(text))
    return KnownFile{"KITTI's poses, without times", "with its times.txt beside it `fbvins eval` reads it"};
  return std::nullopt;
}

}  // namespace

std::optional<KnownFile> known_file(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    if (!fs::exists(path + "/summary.json", ignored) || !fs::exists(path + "/trajectory.csv", ignored)) return std::nullopt;
    return KnownFile{"the results of a flight", "`fbvins report` shows them, `fbvins eval` compares their trajectory"};
  }
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  const std::string text = beginning_of(path);
  if (text.empty()) return KnownFile{"an empty file", "there is nothing in it"};
  if (auto known = by_bytes(path, text)) return known;
  if (auto known = by_words(path, text)) return known;
  if (fs::file_size(path, ignored) > kLargestText_bytes || text.find('\0') != std::string::npos) return std::nullopt;
  return by_rows(path, text);
}

}  // namespace fbvins
