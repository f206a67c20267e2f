// SPDX-License-Identifier: Apache-2.0
// `fbvins live --check`: a check of the sensors before the first flight.
#pragma once

#include "fbvins/live/source.hpp"

namespace fbvins::app {

/// Prints rates, gaps, clocks and the doctor's findings. Returns 1 if something is wrong.
int check_sensors(Source& source, double seconds);

}  // namespace fbvins::app
