// SPDX-License-Identifier: Apache-2.0
// The output folder of `fbvins run`, read back. Values; one thread.
//
//   Result<RunFolder> run = read_run_folder("out/MH_01_easy-klt");
//   if (!run->truth.empty()) show(run_errors(*run));
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/report/csv_table.hpp"
#include "fbvins/report/flight_curves.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

struct RunFolder {
  std::string name;  ///< of the folder
  std::string dataset, frontend, version;
  nlohmann::ordered_json summary;  ///< summary.json
  std::string config;              ///< config.yaml, the effective configuration
  std::vector<Odometry> odometry;  ///< from trajectory.csv and covariance.csv, without statistics
  std::vector<TrajectoryPoint> truth;
  std::string truth_recognised;  ///< TrajectoryFile::recognised
  CsvTable statistics, timing;
  std::optional<FlightFiles> flight;  ///< if `fbvins fly` wrote the folder

  /// Stamp of the first image.
  Time start() const { return odometry.empty() ? Time{} : odometry.front().t; }
};

/// `truth`: a recording or trajectory file; empty: the folder's own ground_truth.csv, if there is one.
Result<RunFolder> read_run_folder(const std::string& path, const std::string& truth = "");

}  // namespace fbvins
