// SPDX-License-Identifier: Apache-2.0
// What `fbvins fly` leaves beside a run, for the page: where the vehicle was, its estimate and its setpoint, its
// modes, and what its motors did. Pure functions.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "fbvins/report/csv_table.hpp"

namespace fbvins {

struct FlightFiles {
  nlohmann::ordered_json summary;  ///< flight.json
  CsvTable rows;                   ///< flight.csv
};

/// JSON text; times count from `start`.
std::string flight_text(const FlightFiles& flight, Time start, std::size_t max_points);

}  // namespace fbvins
