// SPDX-License-Identifier: Apache-2.0
#include "apps/open_recording.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "fbvins/bags/bag_survey.hpp"
#include "fbvins/io/kalibr.hpp"

namespace fbvins::app {
namespace {

namespace fs = std::filesystem;

std::string beginning(const std::string& path, std::size_t most) {
  std::string text(most, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(most));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return text;
}

/// An MCAP file of another program: ours name themselves in the first record.
bool is_foreign_mcap(const std::string& path) {
  constexpr std::size_t kHeader_bytes = 64;
  const std::string text = beginning(path, kHeader_bytes);
  return text.starts_with("\x89MCAP") && text.find("fbvins") == std::string::npos;
}

bool is_foreign_folder(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder / "metadata.yaml", ignored) || fs::exists(folder / "dso/camchain.yaml", ignored)) return true;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".db3" || is_foreign_mcap(entry.path().string())) return true;
  return false;
}

bool is_foreign_recording(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return is_foreign_folder(path);
  return path.ends_with(".bag") || path.ends_with(".db3") || beginning(path, 7) == "#ROSBAG" || is_foreign_mcap(path);
}

bool is_foreign_calibration(const std::string& path) {
  constexpr std::size_t kMost_bytes = 1u << 20u;
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return true;
  // Two files of camera_info.
  const std::string text = beginning(fs::exists(path, ignored) ? path : path.substr(0, path.find(',')), kMost_bytes);
  return !text.empty() && text.find("T_cam_imu") == std::string::npos;
}

}  // namespace

bool is_for_bags(int argc, char** argv) {
  constexpr std::string_view kCommands[] = {"run", "info", "doctor", "eval"};
  if (argc < 3 || std::find(std::begin(kCommands), std::end(kCommands), std::string_view(argv[1])) == std::end(kCommands))
    return false;
  const std::string last = argv[argc - 1];
  if (argv[1] == std::string_view("info") && (last.ends_with(".yaml") || last.ends_with(".yml") || last.ends_with(".json")))
    return true;
  for (int i = 2; i < argc; ++i) {
    const std::string_view argument = argv[i], before = argv[i - 1];
    if (argument.starts_with("--topics")) return true;
    if (argument.starts_with("--calibration=") && is_foreign_calibration(std::string(argument.substr(14)))) return true;
    if (before == "--calibration" && is_foreign_calibration(argv[i])) return true;
    if (!argument.starts_with("-") && before != "--out" && is_foreign_recording(argv[i])) return true;
  }
  return false;
}

std::optional<BagSurvey> survey_recording(const RecordingArguments&) { return std::nullopt; }

Result<StereoRig> calibration_in(const std::string& path) { return load_kalibr(path); }

Result<Trajectory<W>> open_poses(const std::string& path, const std::string& topic) {
  if (topic.empty()) return read_pose_file(path);
  return Error{ErrorCode::invalid_argument, path + ": is no bag, which alone has topics"};
}

Result<std::unique_ptr<Dataset>> open_recording(const RecordingArguments& arguments, const DatasetOptions& options) {
  DatasetOptions with = options;
  with.kalibr_camchain = arguments.calibration;
  with.kalibr_imu = arguments.imu_calibration;
  with.start_s = arguments.start_s;
  with.duration_s = arguments.duration_s;
  with.camera = arguments.camera;
  with.pair_tolerance_ms = arguments.pair_tolerance_ms;
  return open_dataset(arguments.path, with);
}

}  // namespace fbvins::app
