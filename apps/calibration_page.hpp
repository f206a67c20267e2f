// SPDX-License-Identifier: Apache-2.0
// A calibration as one HTML page with plots. Pure function.
#pragma once

#include <string>

#include "apps/calibration_report.hpp"

namespace fbvins::app {

std::string calibration_html(const CalibrationOutcome& outcome);

}  // namespace fbvins::app
