// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/flight_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

/// A position is averaged over this time.
constexpr double kMeasured_s = 2.0;

bool by_poses(FlightMode mode) {
  return mode == FlightMode::mission || mode == FlightMode::holding || mode == FlightMode::landing;
}
bool airborne(const FlightRow& row) { return by_poses(row.autopilot.mode) || row.autopilot.mode == FlightMode::descending; }

/// Mean true position of the rows with t in [to - kMeasured_s, to): from the world's origin, along the axes of L.
Vec3 measured(const FlightLog& log, double to_s) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (const FlightRow& row : log.rows)
    if (row.t_s >= to_s - kMeasured_s && row.t_s < to_s) sum += row.truth.p, ++count;
  const Vec3 start = log.start.q.conjugate() * log.start.p;
  return count > 0 ? Vec3(sum / count + start) : start;
}

/// The last row of the mission's last step in the air.
const FlightRow* last_of_mission(const FlightLog& log, const Mission& mission) {
  std::size_t last = mission.steps.size() - 1;
  if (mission.steps[last].kind == MissionStep::Kind::land && last > 0) --last;
  const FlightRow* found = nullptr;
  for (const FlightRow& row : log.rows)
    if (row.autopilot.mode == FlightMode::mission && row.autopilot.step == last) found = &row;
  return found;
}

/// Accumulates root mean square and maximum.
struct Distances {
  double squares = 0, largest = 0;
  int count = 0;
  void add(const Vec3& d) {
    squares += d.squaredNorm();
    largest = std::max(largest, d.norm());
    ++count;
  }
  DistanceStatistics statistics() const { return {count > 0 ? std::sqrt(squares / count) : 0, largest}; }
};

void add_ends(const FlightLog& log, const Mission& mission, FlightSummary& summary) {
  const FlightRow* end = last_of_mission(log, mission);
  const auto takeoff = std::find_if(log.rows.begin(), log.rows.end(), airborne);
  if (end == nullptr || takeoff == log.rows.end()) return;
  summary.arrived = !log.crash && !log.out_of_time && log.reason == FlightReason::none;
  const Vec3 from = measured(log, takeoff->t_s), to = measured(log, end->t_s), wanted = end->autopilot.setpoint.p;
  for (int i = 0; i < 3; ++i) {
    AxisResult& axis = summary.axes[static_cast<std::size_t>(i)];
    axis = {from[i], to[i], to[i] - from[i], wanted[i], std::abs(to[i] - from[i] - wanted[i])};
    summary.mean_axial_error_m += axis.error / 3;
  }
  summary.distance_m = (to - from - wanted).norm();
}

void add_modes(const FlightLog& log, FlightSummary& summary) {
  double last_s = 0;
  for (const FlightRow& row : log.rows) {
    const FlightReason reason = row.autopilot.reason;
    const std::string_view mode = to_string(row.autopilot.mode);
    const std::string name =
        reason == FlightReason::none ? fmt::format("{}", mode) : fmt::format("{}/{}", mode, to_string(reason));
    if (summary.modes.empty() || summary.modes.back().first != name) summary.modes.emplace_back(name, 0);
    summary.modes.back().second += row.t_s - last_s;
    last_s = row.t_s;
  }
}

void add_way(const FlightLog& log, FlightSummary& summary) {
  Distances tracking, control, estimation;
  double thrust = 0, changes = 0;
  int rows = 0;
  const FlightRow* before = nullptr;
  std::optional<Vec3> blind_from;
  summary.least_battery_V = log.rows.empty() ? 0 : log.rows.front().battery_V;
  for (const FlightRow& row : log.rows) {
    const AutopilotOutput& a = row.autopilot;
    summary.least_battery_V = std::min(summary.least_battery_V, row.battery_V);
    if (!airborne(row)) continue;
    if (by_poses(a.mode)) {
      if (a.mode != FlightMode::landing) {  // the setpoint continues below the floor
        tracking.add(row.truth.p - a.setpoint.p);
        control.add(a.estimate.T_LV.p - a.setpoint.p);
      }
      estimation.add(a.estimate.T_LV.p - row.truth.p);
    } else {
      if (!blind_from) blind_from = row.truth.p;
      summary.drift_blind_m = std::max(summary.drift_blind_m, (row.truth.p - *blind_from).head<2>().norm());
    }
    summary.top_speed_mps = std::max(summary.top_speed_mps, row.true_velocity.norm());
    const double up = std::clamp((row.truth.q * Vec3::UnitZ()).z(), -1.0, 1.0);
    summary.largest_tilt_deg = std::max(summary.largest_tilt_deg, std::acos(up) * 180 / std::numbers::pi);
    thrust += a.control.thrust;
    if (before != nullptr)
      for (std::size_t i = 0; i < kRotors; ++i)
        changes += std::pow(a.control.commands[i] - before->autopilot.control.commands[i], 2) / kRotors;
    before = &row;
    ++rows;
  }
  if (rows > 0) {
    summary.mean_thrust = thrust / rows;
    summary.command_change = std::sqrt(changes / rows);
    if (log.rows.size() > 1) summary.flown_s = rows * (log.rows[1].t_s - log.rows[0].t_s);
  }
  summary.tracking = tracking.statistics();
  summary.control = control.statistics();
  summary.estimation = estimation.statistics();
}

}  // namespace

FlightSummary summarise(const FlightLog& log, const Mission& mission) {
  FlightSummary summary;
  add_ends(log, mission, summary);
  add_way(log, summary);
  add_modes(log, summary);
  return summary;
}

}  // namespace fbvins
