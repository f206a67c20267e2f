// SPDX-License-Identifier: Apache-2.0
// Runs the odometry on a recording and keeps the results: what `fbvins run` and fbvins.run() of Python have in common.
//
//   Result<Flight> flight = run_flight(arguments, config, dataset, {.on_frame = [](int frames) { ... }});
//   RunSummary summary = summarise(*flight, dataset, config, arguments);
//   Result<void> written = write_flight(*flight, summary, config, dataset.ground_truth(), folder);
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "apps/run_map.hpp"
#include "apps/run_output.hpp"
#include "apps/run_summary.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/types/calibration.hpp"

namespace fbvins::app {

struct FlightArguments {
  MapArguments map;
  std::string imu_state;  ///< file: read if it exists, written at a regular end
  bool threaded = false;
};

struct Flight {
  RunRecord run;
  std::optional<MapRecord> map;  ///< with loop closure
  Calibration calibration;       ///< as estimated in the end
  int images_repeated = 0;       ///< and left out
  double wall_s = 0;
};

/// Callbacks during the run; each may be empty.
struct FlightListener {
  std::function<void(int frames)> on_frame = {};        ///< frames processed so far
  std::function<void(const Finding&)> on_finding = {};  ///< a wrong setup, as the first seconds show
};

/// Sends the whole recording through the system, ends the map and saves it.
Result<Flight> run_flight(const FlightArguments& arguments, const Config& config, Dataset& data, const FlightListener& listener);

RunSummary summarise(const Flight& flight, const Dataset& data, const Config& config, const FlightArguments& arguments);

/// All files of a run; the folder is made.
Result<void> write_flight(const Flight& flight, const RunSummary& summary, const Config& config,
                          const std::vector<TrajectoryPoint>& truth, const std::string& folder);

}  // namespace fbvins::app
