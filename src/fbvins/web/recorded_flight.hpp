// SPDX-License-Identifier: Apache-2.0
// Private: a flight record (docs/flight_record.md) as a finished flight.
#pragma once

#include "fbvins/web/finished_flight.hpp"

namespace fbvins {

Result<std::unique_ptr<FinishedFlight>> open_recorded_flight(const std::string& path);

}  // namespace fbvins
