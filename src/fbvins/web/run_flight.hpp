// SPDX-License-Identifier: Apache-2.0
// Private: what `fbvins run --out` and `fbvins live --out` leave in a folder, as a finished flight.
#pragma once

#include "fbvins/web/finished_flight.hpp"

namespace fbvins {

/// trajectory.csv is needed; statistics.csv and timing.csv are used where they are there.
Result<std::unique_ptr<FinishedFlight>> open_run_flight(const std::string& folder, const std::string& recording);

}  // namespace fbvins
