// SPDX-License-Identifier: Apache-2.0
// The additional files of `fbvins fly`, for the page: the vehicle's true and estimated position, its setpoint, flight modes and
// motor commands. Pure functions.
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
