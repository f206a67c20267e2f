// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/board_recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestCsv_bytes = std::uint64_t{1} << 30u, kLargestImage_bytes = std::uint64_t{1} << 28u,
                        kLargestYaml_bytes = 1u << 20u;

struct Listed {
  Time t;
  int camera = 0;
  std::string path;
};

}  // namespace

struct BoardRecording::State {
  std::unique_ptr<FileSource> files;
  std::string root;
  std::vector<Listed> listed;
  std::size_t next = 0;
  int cameras = 0;
  std::vector<ImuSample> imu;
  std::optional<ImuNoise> imu_noise;

  Result<void> list_camera(int camera) {
    const std::string folder = fmt::format("{}cam{}/", root, camera);
    Result<std::string> csv = files->read(folder + "data.csv", kLargestCsv_bytes);
    if (!csv) return csv.error();
    auto rows = read_image_rows(*csv, files->describe(folder + "data.csv"));
    if (!rows) return rows.error();
    for (const ImageRow& row : rows->rows) listed.push_back({row.t, camera, folder + "data/" + row.file});
    return {};
  }

  Result<void> read_imu() {
    const std::string csv_file = root + "imu0/data.csv", yaml_file = root + "imu0/sensor.yaml";
    if (!files->exists(csv_file)) return {};
    Result<std::string> csv = files->read(csv_file, kLargestCsv_bytes);
    if (!csv) return csv.error();
    auto rows = read_stamped_rows<ImuSample>(*csv, files->describe(csv_file), ImuRowParser{});
    if (!rows) return rows.error();
    imu = std::move(rows->rows);
    if (!files->exists(yaml_file)) return {};
    Result<std::string> yaml = files->read(yaml_file, kLargestYaml_bytes);
    if (!yaml) return yaml.error();
    Result<ImuSensor> sensor = parse_euroc_imu({files->describe(yaml_file), *std::move(yaml)});
    if (!sensor) return sensor.error();
    imu_noise = sensor->noise;
    return {};
  }
};

BoardRecording::BoardRecording(std::unique_ptr<State> state) : state_(std::move(state)) {}
BoardRecording::BoardRecording(BoardRecording&&) noexcept = default;
BoardRecording& BoardRecording::operator=(BoardRecording&&) noexcept = default;
BoardRecording::~BoardRecording() = default;

int BoardRecording::cameras() const { return state_->cameras; }
int BoardRecording::images() const { return static_cast<int>(state_->listed.size()); }
const std::vector<ImuSample>& BoardRecording::imu() const { return state_->imu; }
const std::optional<ImuNoise>& BoardRecording::imu_noise() const { return state_->imu_noise; }

Result<BoardRecording> BoardRecording::open(const std::string& path) {
  Result<std::unique_ptr<FileSource>> files = open_file_source(path);
  if (!files) return files.error();
  auto state = std::make_unique<State>();
  state->files = *std::move(files);
  const std::vector<std::string> roots = state->files->folders_holding("cam0/data.csv");
  if (roots.size() != 1)
    return Error{ErrorCode::not_found, roots.empty()
                                           ? fmt::format("{}: no cam0/data.csv in it: not a recording in EuRoC's layout", path)
                                           : fmt::format("{}: holds {} recordings, give one of them", path, roots.size())};
  state->root = roots.front();
  while (state->cameras < kMostCameras && state->files->exists(fmt::format("{}cam{}/data.csv", state->root, state->cameras)))
    if (Result<void> done = state->list_camera(state->cameras++); !done) return done.error();
  std::ranges::stable_sort(state->listed,
                           [](const Listed& a, const Listed& b) { return a.t != b.t ? a.t < b.t : a.camera < b.camera; });
  if (Result<void> done = state->read_imu(); !done) return done.error();
  return BoardRecording(std::move(state));
}

std::optional<TakenImage> BoardRecording::next() {
  if (state_->next == state_->listed.size()) return std::nullopt;
  const Listed& listed = state_->listed[state_->next++];
  TakenImage out{listed.t, listed.camera, state_->files->describe(listed.path), {}};
  if (Result<std::string> bytes = state_->files->read(listed.path, kLargestImage_bytes); bytes) out.bytes = *std::move(bytes);
  return out;
}

}  // namespace fbvins
