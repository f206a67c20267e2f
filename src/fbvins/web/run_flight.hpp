// SPDX-License-Identifier: Apache-2.0
// Private: a folder of `fbvins run --out` or `fbvins live --out` as a finished flight.
#pragma once

#include "fbvins/web/finished_flight.hpp"

namespace fbvins {

/// trajectory.csv is required; statistics.csv, gauge.csv and summary.json are used if present.
Result<std::unique_ptr<FinishedFlight>> open_run_flight(const std::string& folder, const std::string& recording);

}  // namespace fbvins
