// SPDX-License-Identifier: Apache-2.0
// A flight's summary: text for people, in the form of the paper's Tables 2 and 3, and JSON for programs. The same flight gives
// the same bytes.
#pragma once

#include <string>

#include "fbvins/flight/flight_summary.hpp"

namespace fbvins::app {

/// The arguments of the flight.
struct FlightFacts {
  std::string mission, preset, frontend, vehicle;
  int seed = 0;
  bool loop = false;
  ControllerProgram::Kind controller = ControllerProgram::Kind::own;
};

std::string flight_text(const FlightFacts& facts, const FlightLog& log, const FlightSummary& summary);
std::string flight_json_text(const FlightFacts& facts, const FlightLog& log, const FlightSummary& summary);

}  // namespace fbvins::app
