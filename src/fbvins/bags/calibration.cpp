// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/bags/foreign_calibration.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/kalibr.hpp"
#include "fbvins/io/kalibr_imu.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

/// A file that another one names, beside it.
std::string beside(const std::string& file, const std::string& name) { return (fs::path(file).parent_path() / name).string(); }

bool holds(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

Result<StereoRig> with_imu(Result<StereoRig> rig, const std::string& imu_path) {
  return !rig || imu_path.empty() ? rig : with_imu_file(*rig, imu_path);
}

/// Its estimator_config.yaml names the other two.
Result<StereoRig> load_openvins(const std::string& path, const std::string& text, const std::string& imu_path) {
  YamlReader yaml(path, text);
  if (!holds(text, "relative_config_imucam"))
    return with_imu(parse_openvins_cameras(std::move(yaml), files_beside(path)), imu_path);
  const std::string cameras = yaml.word(yaml.root(), "relative_config_imucam"),
                    imu = yaml.text(yaml.root(), "relative_config_imu");
  if (!yaml.ok()) return yaml.error();
  const Result<std::string> chain = read_file(beside(path, cameras), kLargestYaml_bytes);
  if (!chain) return chain.error();
  const std::string noise = !imu_path.empty() ? imu_path : imu.empty() ? "" : beside(path, imu);
  const std::string chain_path = beside(path, cameras);
  return with_imu(parse_openvins_cameras({chain_path, *chain}, files_beside(chain_path)), noise);
}

Result<StereoRig> load_vins_fusion(const std::string& path, const std::string& text) {
  YamlReader yaml(path, text);
  std::vector<YamlReader> cameras;
  for (const char* field : {"cam0_calib", "cam1_calib"}) {
    if (!cameras.empty() && !yaml.has(yaml.root(), field)) break;  // num_of_cam is 1
    const std::string name = beside(path, yaml.word(yaml.root(), field));
    if (!yaml.ok()) return yaml.error();
    Result<std::string> camera = read_file(name, kLargestYaml_bytes);
    if (!camera) return camera.error();
    cameras.emplace_back(name, *std::move(camera));
  }
  return parse_vins_fusion(std::move(yaml), std::move(cameras));
}

/// The files beside it are named alike.
Result<StereoRig> load_kimera(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  std::vector<YamlReader> cameras;
  std::optional<YamlReader> imu;
  const auto read = [&](const std::string& name) -> Result<YamlReader> {
    const Result<std::string> text = read_file(name, kLargestYaml_bytes);
    if (!text) return text.error();
    return YamlReader(name, *text);
  };
  std::error_code ignored;
  const fs::path left = folder / "LeftCameraParams.yaml", right = folder / "RightCameraParams.yaml",
                 noise = folder / "ImuParams.yaml";
  const bool known = fs::exists(left, ignored);
  for (const fs::path& name : {known ? left : fs::path(path), right}) {
    if (!cameras.empty() && (!known || !fs::exists(name, ignored))) break;
    Result<YamlReader> camera = read(name.string());
    if (!camera) return camera.error();
    cameras.push_back(*std::move(camera));
  }
  if (fs::exists(noise, ignored)) {
    Result<YamlReader> file = read(noise.string());
    if (!file) return file.error();
    imu = *std::move(file);
  }
  return parse_kimera(std::move(cameras), std::move(imu));
}

Result<StereoRig> load_euroc(const std::string& folder) {
  const auto files = open_file_source(folder);
  if (!files) return files.error();
  const std::vector<std::string> roots = (*files)->folders_holding("cam0/sensor.yaml");
  if (roots.size() != 1)
    return Error{ErrorCode::not_found, fmt::format("{}: holds {} files cam0/sensor.yaml, not one", folder, roots.size())};
  const auto parse = [&](const std::string& name, auto parser) -> decltype(parser(std::declval<YamlReader>())) {
    const Result<std::string> text = (*files)->read(roots[0] + name, kLargestYaml_bytes);
    if (!text) return text.error();
    return parser({name, *text});
  };
  std::vector<CameraSensor> cameras;
  for (int i = 0; i < kMostCameras; ++i) {
    const std::string camera = fmt::format("cam{}/", i);
    if (i > 0 && !(*files)->exists(roots[0] + camera + "sensor.yaml")) break;
    const ReadBeside beside = [&](const std::string& name) {
      return (*files)->read(roots[0] + camera + name, kLargestMask_bytes);
    };
    const auto sensor =
        parse(camera + "sensor.yaml", [&](YamlReader yaml) { return parse_euroc_camera(std::move(yaml), beside); });
    if (!sensor) return sensor.error();
    cameras.push_back(*sensor);
  }
  const auto imu = parse("imu0/sensor.yaml", parse_euroc_imu);
  if (!imu) return imu.error();
  const Result<StereoRig> rig = join_euroc(cameras, *imu, folder);
  if (!rig || cameras.size() > 1 || !(*files)->exists(roots[0] + "depth0/sensor.yaml")) return rig;
  const auto depth = parse("depth0/sensor.yaml", [&](YamlReader yaml) { return parse_depth_sensor(std::move(yaml), imu->T_BS); });
  if (!depth) return depth.error();
  return with_depth(*rig, *depth);
}

Error several_files(const std::string& paths) {
  std::vector<std::string_view> files;
  split_at_commas(paths, files);
  for (const std::string_view file : files) {
    const Result<std::string> text = read_file(std::string(file), kLargestYaml_bytes);
    if (!text) return text.error();
    if (calibration_format(*text) != "camera_info")
      return {ErrorCode::unsupported,
              fmt::format("{}: several files are read of ROS's camera_info alone, which this is not", file)};
    if (file.data() + file.size() == paths.data() + paths.size()) return camera_info_alone({std::string(files.front()), *text});
  }
  return {ErrorCode::not_found, paths + ": no such file"};
}

}  // namespace

std::string calibration_format(const std::string& text) {
  if (holds(text, "body_T_cam0")) return "VINS-Fusion";
  if (holds(text, "\"value0\"") && !holds(text, "config.")) return "Basalt";
  if (holds(text, "T_cam_imu")) return "Kalibr";
  if (holds(text, "projection_parameters") && (holds(text, "extrinsicRotation") || holds(text, "imu_topic"))) return "VINS-Mono";
  if (holds(text, "Camera.type") || holds(text, "Camera.fx") || holds(text, "Camera1.fx")) return "ORB-SLAM3";
  if (holds(text, "\"cameraData\"")) return "OAK";
  if (holds(text, "camera_id") && holds(text, "T_BS")) return "Kimera";
  if (holds(text, "camera_matrix") && holds(text, "distortion_coefficients") && !holds(text, "opencv")) return "camera_info";
  if (holds(text, "relative_config_imucam") || holds(text, "T_imu_cam")) return "OpenVINS";
  return "";
}

bool is_kalibr(const std::string& path) {
  const Result<std::string> text = read_file(path, kLargestYaml_bytes);
  return text && calibration_format(*text) == "Kalibr";
}

bool is_camera_info(const std::string& paths) {
  std::vector<std::string_view> files;
  split_at_commas(paths, files);
  return std::ranges::all_of(files, [](std::string_view file) {
    const Result<std::string> text = read_file(std::string(file), kLargestYaml_bytes);
    return text && calibration_format(*text) == "camera_info";
  });
}

Result<StereoRig> load_calibration(const std::string& path, const std::string& imu_path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    for (const char* known : {"LeftCameraParams.yaml", "estimator_config.yaml"})
      if (fs::exists(fs::path(path) / known, ignored)) return load_calibration((fs::path(path) / known).string(), imu_path);
  if (fs::is_directory(path, ignored) || path.ends_with(".zip")) return with_imu(load_euroc(path), imu_path);
  // Lenses alone, of which a bag may have the places.
  if (path.find(',') != std::string::npos && !fs::exists(path, ignored)) return several_files(path);
  const Result<std::string> text = read_file(path, kLargestYaml_bytes);
  if (!text) return text.error();
  const std::string format = calibration_format(*text);
  if (format == "OpenVINS") return load_openvins(path, *text, imu_path);
  if (format == "Basalt") return with_imu(parse_basalt({path, *text}), imu_path);
  if (format == "VINS-Fusion") return with_imu(load_vins_fusion(path, *text), imu_path);
  if (format == "VINS-Mono") return with_imu(parse_vins_mono({path, *text}), imu_path);
  if (format == "ORB-SLAM3") return with_imu(parse_orbslam({path, *text}), imu_path);
  if (format == "OAK") return with_imu(parse_oak({path, *text}), imu_path);
  if (format == "Kimera") return with_imu(load_kimera(path), imu_path);
  if (format == "camera_info") return camera_info_alone({path, *text});
  return load_kalibr(path, imu_path.empty() ? std::nullopt : std::optional(imu_path));
}

Result<StereoRig> load_camera_info(const std::string& left_path, const std::string& right_path, const Pose<B, C0>& T_BC0) {
  const Result<std::string> left = read_file(left_path, kLargestYaml_bytes), right = read_file(right_path, kLargestYaml_bytes);
  if (!left) return left.error();
  if (!right) return right.error();
  return parse_camera_info({left_path, *left}, {right_path, *right}, T_BC0);
}

}  // namespace fbvins
