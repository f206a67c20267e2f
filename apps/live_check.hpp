// SPDX-License-Identifier: Apache-2.0
// `fbvins live --check`: a look at the sensors before the first flight.
#pragma once

#include "fbvins/live/source.hpp"

namespace fbvins::app {

/// What comes, how often, by which clock, and what the doctor says of it. 1 where something is wrong.
int check_sensors(Source& source, double seconds);

}  // namespace fbvins::app
