// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/camera_recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/camera/camera.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/euroc_rows.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestFile_bytes = std::uint64_t{1} << 28u, kLargestYaml_bytes = 1u << 20u;

/// Reads a EuRoC folder step by step.
class EurocCameras {
 public:
  EurocCameras(std::shared_ptr<const FileSource> files, std::string root) : files_(std::move(files)), root_(std::move(root)) {}

  Result<CameraRecording> read() {
    EurocSensors sensors;
    for (int k = 0; k < kMostCameras && files_->exists(fmt::format("{}cam{}/data.csv", root_, k)); ++k)
      sensors.cameras.push_back(fmt::format("cam{}/", k));
    sensors.imu = files_->exists(root_ + "imu0/data.csv");
    Result<EurocRows> rows = read_euroc_rows(*files_, root_, sensors);
    if (!rows) return rows.error();
    out_.warnings = rows->clock.said;
    for (std::size_t k = 0; k < rows->cameras.size(); ++k)
      list_camera(static_cast<int>(k), sensors.cameras[k], rows->cameras[k].rows);
    if (sensors.imu)
      if (Result<void> done = take_imu(std::move(rows->imu.rows)); !done) return done.error();
    sort_by_time(out_.images);
    out_.take = [files = files_, images = out_.images, bits = used_bits()](std::size_t index) -> CameraRecording::Decode {
      Result<std::string> bytes = files->read(images[index].name, kLargestFile_bytes);
      if (!bytes) return [error = bytes.error()]() -> Result<Image> { return error; };
      return [bytes = *std::move(bytes), bits] { return decode_image(bytes, bits); };
    };
    return std::move(out_);
  }

 private:
  /// Of images of 16 bits, from some spread over the recording.
  int used_bits() const {
    constexpr std::size_t kTried = 16;
    std::uint16_t largest = 0;
    const std::size_t step = std::max<std::size_t>(1, out_.images.size() / kTried);
    for (std::size_t i = 0; i < out_.images.size(); i += step)
      if (const Result<std::string> bytes = files_->read(out_.images[i].name, kLargestFile_bytes); bytes)
        largest = std::max(largest, largest_value_of_png(*bytes).value_or(0));
    return bits_used_for(largest);
  }

  void list_camera(int camera, const std::string& folder, const std::vector<ImageRow>& rows) {
    for (const ImageRow& row : rows) out_.images.push_back({row.t, camera, root_ + folder + "data/" + row.file});
    out_.cameras.push_back(fmt::format("cam{}", camera));
  }

  Result<void> take_imu(std::vector<ImuSample> readings) {
    const std::string yaml_file = root_ + "imu0/sensor.yaml";
    out_.imu_name = "imu0";
    out_.imu = std::move(readings);
    if (!files_->exists(yaml_file)) return {};
    Result<std::string> yaml = files_->read(yaml_file, kLargestYaml_bytes);
    if (!yaml) return yaml.error();
    Result<ImuSensor> sensor = parse_euroc_imu({files_->describe(yaml_file), *std::move(yaml)});
    if (!sensor) return sensor.error();
    out_.imu_noise = sensor->noise;
    return {};
  }

  std::shared_ptr<const FileSource> files_;
  std::string root_;
  CameraRecording out_;
};

}  // namespace

void sort_by_time(std::vector<ListedImage>& images) {
  std::ranges::stable_sort(
      images, [](const ListedImage& a, const ListedImage& b) { return a.t != b.t ? a.t < b.t : a.camera < b.camera; });
}

Result<CameraRecording> open_euroc_cameras(const std::string& path) {
  Result<std::unique_ptr<FileSource>> files = open_file_source(path);
  if (!files) return files.error();
  const std::vector<std::string> roots = (*files)->folders_holding("cam0/data.csv");
  if (roots.size() != 1)
    return Error{ErrorCode::not_found,
                 roots.empty() ? fmt::format("{}: no cam0/data.csv in it: neither a recording in EuRoC's layout nor a bag", path)
                               : fmt::format("{}: holds {} recordings, give one of them", path, roots.size())};
  return EurocCameras(*std::move(files), roots.front()).read();
}

}  // namespace fbvins
