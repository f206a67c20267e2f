// SPDX-License-Identifier: Apache-2.0
// Opens recordings for commands. Each program links its own definition: `fbvins` reads EuRoC recordings and flight records
// (open_recording.cpp), fbvins-bags also third-party ones (open_foreign_recording.cpp), which `fbvins` hands over to
// it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/types/trajectory.hpp"

namespace CLI {
class App;
}

namespace fbvins {
struct BagSurvey;
}

namespace fbvins::app {

struct RecordingArguments {
  std::string path, calibration, imu_calibration;
  std::vector<std::string> topics;     ///< of a bag: those of the cameras, of the IMU and of depth images
  bool by_recording = false;           ///< of a bag: RecordingOptions
  double start_s = 0, duration_s = 0;  ///< DatasetOptions
  std::string camera = "all";          ///< the same
  double pair_tolerance_ms = DatasetOptions{}.pair_tolerance_ms;

  void add_to(CLI::App& command);
  /// All but the recording itself.
  void add_options_to(CLI::App& command);
};

Result<std::unique_ptr<Dataset>> open_recording(const RecordingArguments& arguments, const DatasetOptions& options);

/// Prints a recording's warnings, each once: those of opening it, and at the end those that came up while it was read.
class RecordingWarnings {
 public:
  void print(const DatasetInfo& info);
  /// With the number of images that could not be used.
  void print_at_end(const DatasetInfo& info);

 private:
  std::size_t printed_ = 0;
};

/// What is in a bag that cannot be opened as a recording yet (fbvins/bags/bag_survey.hpp); none where it is no bag, or this
/// program reads none.
std::optional<BagSurvey> survey_recording(const RecordingArguments& arguments);

/// The calibration in a file of any kind that this program reads; an error where it is none.
Result<StereoRig> calibration_in(const std::string& path);

/// A trajectory file; says how an unusual one was read, and warns of rows that are left out.
Result<Trajectory<W>> read_pose_file(const std::string& path, const TrajectoryFormat& format = {});
/// The poses of a file: TUM or EuRoC; in fbvins-bags also of a bag, from `topic` or its only topic of poses.
Result<Trajectory<W>> open_poses(const std::string& path, const std::string& topic);

/// Whether a command line names something that only fbvins-bags reads: a bag, a TUM-VI folder, a calibration that is not
/// Kalibr's, topics.
bool is_for_bags(int argc, char** argv);

}  // namespace fbvins::app
