// SPDX-License-Identifier: Apache-2.0
// Results of a matrix: one row per cell, as CSV and JSON, and compared with an earlier run. Pure except for reading files.
//
//   std::vector<CellResult> results = read_results(plan, "bench");
//   std::vector<Regression> worse = regressions(results, *reference, {});
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/experiment/matrix.hpp"
#include "fbvins/report/run_errors.hpp"

namespace fbvins {

struct CellResult {
  Cell cell;
  Recording recording;
  std::string status;  ///< "ok", "no pose", "no truth" or "failed"
  std::string version, config;
  std::optional<Evaluation> evaluation;
  double coverage = 0, first_pose_after_s = 0;
  int restarts = 0, lost_frames = 0;
  double cpu_ms = 0, cpu_p99_ms = 0, peak_mb = 0;
  std::string trajectory_hash;                               ///< of trajectory.csv: equal for equal bytes
  StateNees nees;                                            ///< mean over the run
  std::vector<std::pair<double, StateNees>> nees_over_time;  ///< seconds after the first image
};

/// Every cell of the plan; those without results have the status "failed".
std::vector<CellResult> read_results(const Plan& plan, const std::string& out);

std::string results_csv(const std::vector<CellResult>& results);
/// With the machine, the program's version and each cell's effective configuration.
nlohmann::ordered_json results_json(const std::string& title, const std::vector<CellResult>& results);

struct Tolerance {
  double share = 0.2;      ///< relative increase of an error that is tolerated
  double floor_m = 0.002;  ///< absolute increase that is tolerated in addition
  double coverage = 0.02;  ///< decrease of coverage that is tolerated
};

/// A cell of an earlier results.csv; NaN where a field is no number.
struct Reference {
  double rmse_m = 0, coverage = 0, restarts = 0;
};

Result<std::map<std::string, Reference>> read_reference(const std::string& path);

struct Regression {
  std::string cell, what;
};

/// Cells that are worse than their reference; cells without one are skipped.
std::vector<Regression> regressions(const std::vector<CellResult>& results, const std::map<std::string, Reference>& reference,
                                    const Tolerance& tolerance);

}  // namespace fbvins
