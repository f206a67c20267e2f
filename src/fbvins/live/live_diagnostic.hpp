// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/live_event.hpp"

namespace fbvins {

/// The status of a live system as a ROS 2 diagnostic: level, sentence, counters and latencies as values.
RosDiagnostic diagnostic_of(const LiveStatus& status);

}  // namespace fbvins
