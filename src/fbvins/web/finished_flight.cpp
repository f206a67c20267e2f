// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/finished_flight.hpp"

#include "fbvins/io/mcap_dataset.hpp"
#include "fbvins/web/recorded_flight.hpp"
#include "fbvins/web/run_flight.hpp"

namespace fbvins {

Result<std::unique_ptr<FinishedFlight>> open_finished_flight(const std::string& path, const std::string& recording) {
  if (is_mcap(path)) return open_recorded_flight(path);
  return open_run_flight(path, recording);
}

}  // namespace fbvins
