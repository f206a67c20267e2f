// SPDX-License-Identifier: Apache-2.0
// Summary of a run: JSON for programs, text for people. The part `result` is the same bytes from run
// to run; `timing` is not.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "apps/evaluation_report.hpp"
#include "apps/run_map.hpp"
#include "apps/run_output.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins::app {

/// The calibration as the flight has refined it: what the options let it refine.
struct RefinedCalibration {
  std::optional<double> time_offset_s, line_delay_s;
  std::vector<Pose<B, C0>> T_BC;  ///< of the left camera, and the right one
};

struct RunSummary {
  std::string frontend;
  std::string booster_weights;  ///< the file, of the boost frontend
  std::string mode;             ///< deterministic or threaded
  std::string dataset;          ///< its name, not its path
  int frames = 0;               ///< stereo frames that reached the frontend
  int images_bad = 0;           ///< image files missing, corrupt or of the wrong size
  Coverage coverage;
  int restarts = 0;                                 ///< times the estimator started anew after its first pose
  std::vector<std::pair<std::string, int>> health;  ///< frames per "state" or "state/reason"
  std::map<int, int> without_cameras;               ///< frames in which a camera was not used, by its number
  std::optional<Evaluation> evaluation;             ///< where the recording holds ground truth
  std::string no_evaluation;                        ///< why there is none
  std::optional<NeesSummary> nees;                  ///< after alignment of position and heading in the first second
  std::optional<NeesSummary> nees_levelled;         ///< the same without the truth's own constant tilt
  LevelledStart truth_level;                        ///< that tilt, and the alignment without it
  std::optional<MapSummary> map;                    ///< with loop closure
  std::optional<RefinedCalibration> refined;
  double time_offset_found_s = 0;              ///< besides that of the calibration; the ground truth was shifted by it
  DescriptorMatchCounts matches, raw_matches;  ///< over all frames; none of the klt frontend
  Survival survival;                           ///< over all frames
  double wall_s = 0;
  std::vector<double> frontend_ms, estimator_ms, boost_ms;  ///< CPU time per frame
  double peak_memory_mb = 0;
};

/// "state", or "state/reason".
std::string label_of(const Health& health);
/// Of this process so far.
double peak_memory_mb();
/// Besides that of the calibration, at the end; 0 where most poses are not good, as nothing was found then.
double time_offset_found_s(const RunRecord& record);
/// The recording's ground truth as a trajectory; empty where there is none. It is on the IMU's clock, poses are on the images':
/// the calibration's time offset, and what the run found besides, lie between them.
Trajectory<W> truth_of(const Dataset& data, double found_s = 0);
RunSummary summarise(const RunRecord& record, const Dataset& data);
/// The same without a recording: stamps of all images, and the truth, which may be empty.
RunSummary summarise(const RunRecord& record, std::vector<Time> images, const Trajectory<W>& truth);
std::string to_json_text(const RunSummary& summary);
std::string to_text(const RunSummary& summary);
/// config.yaml, summary.json, summary.txt.
Result<void> write_summary(const RunSummary& summary, const Config& config, const std::string& folder);

}  // namespace fbvins::app
