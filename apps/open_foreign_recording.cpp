// SPDX-License-Identifier: Apache-2.0
#include "apps/open_recording.hpp"
#include "fbvins/bags/bag_poses.hpp"
#include "fbvins/bags/bag_survey.hpp"
#include "fbvins/bags/calibration.hpp"
#include "fbvins/bags/recording.hpp"

namespace fbvins::app {

namespace {

RecordingOptions options_of(const RecordingArguments& arguments, const DatasetOptions& options) {
  DatasetOptions with = options;
  with.start_s = arguments.start_s;
  with.duration_s = arguments.duration_s;
  with.camera = arguments.camera;
  with.pair_tolerance_ms = arguments.pair_tolerance_ms;
  return {with, arguments.calibration, arguments.imu_calibration, arguments.topics, arguments.by_recording};
}

}  // namespace

Result<std::unique_ptr<Dataset>> open_recording(const RecordingArguments& arguments, const DatasetOptions& options) {
  return fbvins::open_recording(arguments.path, options_of(arguments, options));
}

std::optional<BagSurvey> survey_recording(const RecordingArguments& arguments) {
  if (!is_bag(arguments.path)) return std::nullopt;
  Result<BagSurvey> survey = survey_bag(arguments.path, options_of(arguments, {}));
  return survey ? std::optional(*std::move(survey)) : std::nullopt;
}

Result<StereoRig> calibration_in(const std::string& path) { return load_calibration(path); }

Result<Trajectory<W>> open_poses(const std::string& path, const std::string& topic) {
  if (is_bag(path)) return read_bag_poses(path, topic);
  return read_pose_file(path);
}

bool is_for_bags(int, char**) { return false; }

}  // namespace fbvins::app
