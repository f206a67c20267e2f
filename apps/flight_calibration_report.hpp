// SPDX-License-Identifier: Apache-2.0
// What `fbvins calibrate --from-flight` prints and writes. Pure functions but for write_flight_calibration().
#pragma once

#include <string>
#include <vector>

#include "fbvins/calibration/flight_calibration.hpp"

namespace fbvins::app {

/// For people: what changed, what is as given, what the flights do not determine, and the verdict.
std::string flight_calibration_text(const FlightCalibration& found);
std::string flight_calibration_json(const FlightCalibration& found, const std::vector<std::string>& runs);

/// The calibration, refined or as given, in all formats (rig_files), summary.json and calibration.txt; the folder is made.
Result<void> write_flight_calibration(const FlightCalibration& found, const std::vector<std::string>& runs,
                                      const std::string& folder);

}  // namespace fbvins::app
