// SPDX-License-Identifier: Apache-2.0
// What became of a flight, in numbers: where it ended against where it should have, as the paper's Tables 2 and 3 have it, and
// how well it was known and followed on its way. Pure functions, any thread.
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
  double start = 0, end = 0;  ///< measured: the truth's mean over a while
  double difference = 0;      ///< end less start
  double expected = 0;        ///< what the mission wanted it to be
  double error = 0;           ///< |difference - expected|
};

/// Root mean square and largest of a distance, metres.
struct DistanceStatistics {
  double rmse = 0, max = 0;
};

struct FlightSummary {
  bool arrived = false;  ///< it came to rest at the end of the mission; without, the axes are void
  std::array<AxisResult, 3> axes;
  double mean_axial_error_m = 0, distance_m = 0;  ///< from where it should have come to rest
  DistanceStatistics tracking;                    ///< truth to setpoint, in flight by poses
  DistanceStatistics control;                     ///< estimate to setpoint
  DistanceStatistics estimation;                  ///< estimate to truth
  double top_speed_mps = 0, largest_tilt_deg = 0;
  double drift_blind_m = 0;   ///< sideways, while it came down without poses
  double mean_thrust = 0;     ///< share of full thrust, in flight
  double command_change = 0;  ///< root mean square of a motor's command from reading to reading
  double flown_s = 0, least_battery_V = 0;
  std::vector<std::pair<std::string, double>> modes;  ///< "mode" or "mode/reason", seconds in each, in order of time
};

FlightSummary summarise(const FlightLog& log, const Mission& mission);

/// One row a reading of the IMU, all in L, and three trajectories of the vehicle in L.
Result<void> write_flight(const FlightLog& log, const std::string& folder);

}  // namespace fbvins
