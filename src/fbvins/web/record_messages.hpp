// SPDX-License-Identifier: Apache-2.0
// Private: a flight record's messages as our values again. Nullopt for bytes that are no such message. Pure functions, any
// thread.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/live_event.hpp"

namespace fbvins {

/// A pose with its covariances, of the topic /odometry; the rest of it is void.
std::optional<Odometry> read_record_odometry(std::string_view bytes);
/// What the estimator's own diagnostic says: health, statistics, level; nullopt for that of the live system.
bool take_record_health(const RosDiagnostic& diagnostic, Odometry& odometry);
/// Counts, latencies and health of the live system.
std::optional<LiveStatus> status_of(const RosDiagnostic& diagnostic);
std::optional<std::vector<RosDiagnostic>> read_diagnostics(std::string_view bytes);
/// Features and landmarks of the topic /landmarks.
std::optional<LiveView> read_view(std::string_view bytes);
std::optional<LiveMark> read_mark(std::string_view bytes);

}  // namespace fbvins
