// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "apps/open_recording.hpp"
#include "apps/terminal.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins::app {

void RecordingArguments::add_to(CLI::App& command) {
  command.add_option("DATASET", path, "EuRoC folder or zip, flight record, ROS bag, MCAP file, or TUM-VI folder")->required();
  add_options_to(command);
}

void RecordingArguments::add_options_to(CLI::App& command) {
  command.add_option(
      "--calibration", calibration,
      "calibration instead of the recording's own: a file of Kalibr, OpenVINS, Basalt, VINS-Fusion, VINS-Mono, ORB-SLAM3, "
      "Kimera-VIO or an OAK, a folder or zip of EuRoC's, or for a bag left.yaml,right.yaml of ROS's camera_info");
  command.add_option("--imu-calibration", imu_calibration,
                     "the IMU alone: imu.yaml of Kalibr or OpenVINS, or axes in RealSense's JSON");
  // One argument, so that a recording which follows it is not taken for another topic.
  command.add_option_function<std::string>(
      "--topics", [this](const std::string& text) { topics = CLI::detail::split(text, ','); },
      "topics of a bag, if they are not found: CAM0[,CAM1,...][,IMU][,DEPTH][,sensors beside them]");
  command.add_flag("--recording-time", by_recording,
                   "of a bag: the times of recording instead of stamps that its driver did not set");
  command
      .add_option("--camera", camera,
                  "the cameras that are used: all (default), the first two (both), one of these, or the left "
                  "one with its depth images (depth)")
      ->check(CLI::IsMember({"all", "both", "left", "right", "depth"}));
  command
      .add_option("--pair-tolerance", pair_tolerance_ms,
                  "ms by which the stamps of images that are taken at once may differ; images that are farther apart in all of a "
                  "recording were taken apart")
      ->check(CLI::Range(0.0, 1000.0));
  command.add_option("--start", start_s, "seconds to leave out at the start of the recording")->check(CLI::NonNegativeNumber);
  command.add_option("--duration", duration_s, "seconds to use from there, 0 for all")->check(CLI::NonNegativeNumber);
}

void RecordingWarnings::print(const DatasetInfo& info) {
  for (; printed_ < info.warnings.size(); ++printed_) warn(info.warnings[printed_]);
}

void RecordingWarnings::print_at_end(const DatasetInfo& info) {
  print(info);
  const auto bad = [&](int camera) { return info.camera(camera).images.corrupt + info.camera(camera).images.wrong_size; };
  const int left = bad(0), right = bad(1);
  if (left + right > 0) warn(fmt::format("{} left and {} right images could not be used", left, right));
}

Result<Trajectory<W>> read_pose_file(const std::string& path, const TrajectoryFormat& format) {
  auto file = read_trajectory(path, format);
  if (!file) return file.error();
  if (!file->recognised.empty()) note(fmt::format("{}: {}", path, file->recognised));
  if (file->counts.bad() > 0) warn(fmt::format("{} rows left out, the first: {}", file->counts.bad(), file->counts.first_bad));
  return file->poses();
}

}  // namespace fbvins::app
