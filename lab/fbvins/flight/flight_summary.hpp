// SPDX-License-Identifier: Apache-2.0
// The result of a flight in numbers: its end position against the mission's, as in Tables 2 and 3 of the paper, and the errors
// of estimation and tracking on the way. Pure functions, any thread.
//
//   FlightSummary summary = summarise(log, setup.mission);
//   Result<void> done = write_flight(log, "out");      // flight.csv, truth_tum.txt, estimate_tum.txt, setpoint_tum.txt
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/flight/closed_loop.hpp"

namespace fbvins {

/// One row of the paper's table, metres.
struct AxisResult {
  double start = 0, end = 0;  ///< mean true position over 2 s
  double difference = 0;      ///< end less start
  double expected = 0;        ///< by the mission
  double error = 0;           ///< |difference - expected|
};

/// Root mean square and largest of a distance, metres.
struct DistanceStatistics {
  double rmse = 0, max = 0;
};

struct FlightSummary {
  bool arrived = false;  ///< it finished the mission without crash or failsafe; `axes` may be invalid otherwise
  std::array<AxisResult, 3> axes;
  double mean_axial_error_m = 0, distance_m = 0;  ///< of the end position's error
  DistanceStatistics tracking;                    ///< truth to setpoint, while flying by poses, without landing
  DistanceStatistics control;                     ///< estimate to setpoint
  DistanceStatistics estimation;                  ///< estimate to truth
  double top_speed_mps = 0, largest_tilt_deg = 0;
  double drift_blind_m = 0;   ///< horizontally, while descending without poses
  double mean_thrust = 0;     ///< share of full thrust, in flight
  double command_change = 0;  ///< root mean square of a motor command's change per reading
  double flown_s = 0, least_battery_V = 0;
  std::vector<std::pair<std::string, double>> modes;  ///< "mode" or "mode/reason" and its seconds, in order of time
};

FlightSummary summarise(const FlightLog& log, const Mission& mission);

/// One row per IMU reading, all in L, and three trajectories of V in L.
Result<void> write_flight(const FlightLog& log, const std::string& folder);

}  // namespace fbvins
