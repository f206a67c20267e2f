// SPDX-License-Identifier: Apache-2.0
// Private: decodes a flight record's messages. Nullopt for bytes that are not such a message. Pure functions, any
// thread.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/live_event.hpp"

namespace fbvins {

/// Pose, velocities and pose covariance of the topic /odometry; the rest is left at its default.
std::optional<Odometry> read_record_odometry(std::string_view bytes);
/// Fills in health, statistics and level from the estimator's diagnostic; false for that of the live system.
bool take_record_health(const RosDiagnostic& diagnostic, Odometry& odometry);
/// Counts, latencies and health of the live system.
std::optional<LiveStatus> status_of(const RosDiagnostic& diagnostic);
std::optional<std::vector<RosDiagnostic>> read_diagnostics(std::string_view bytes);
/// Features and landmarks of the topic /landmarks.
std::optional<LiveView> read_view(std::string_view bytes);
std::optional<LiveMark> read_mark(std::string_view bytes);

}  // namespace fbvins
