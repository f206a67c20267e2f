// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/live_diagnostic.hpp"

#include <fmt/format.h>

#include "fbvins/io/flight_record.hpp"

namespace fbvins {
namespace {

std::string text(const LatencySummary& s) {
  return fmt::format("p50 {:.1f}, p99 {:.1f}, max {:.1f} of {}", s.p50_ms, s.p99_ms, s.max_ms, s.count);
}

}  // namespace

RosDiagnostic diagnostic_of(const LiveStatus& s) {
  RosDiagnostic out{health_level(s.health), "live", s.problem.empty() ? to_sentence(s.health) : s.problem, {}};
  out.values = {{"state", std::string(to_string(s.health.state))},  {"reason", std::string(to_string(s.health.reason))},
                {"reset_counter", fmt::to_string(s.reset_counter)}, {"host_ns", fmt::to_string(s.host_t.ns)},
                {"shutter_to_pose_ms", text(s.shutter_to_pose)},    {"pose_age_ms", text(s.pose_age)}};
  s.counts.visit([&](const char* name, std::int64_t count) { out.values.emplace_back(name, fmt::to_string(count)); });
  return out;
}

}  // namespace fbvins
