// SPDX-License-Identifier: Apache-2.0
#include "apps/flight_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace fbvins::app {
namespace {

using Json = nlohmann::ordered_json;

/// Rounded to tenths of a millimetre; further digits have no meaning.
double rounded(double x) { return std::round(1e4 * x) / 1e4; }

Json to_json(const DistanceStatistics& s) { return {{"rmse", rounded(s.rmse)}, {"max", rounded(s.max)}}; }

std::string name_of(ControllerProgram::Kind kind) {
  switch (kind) {
    case ControllerProgram::Kind::px4: return "px4";
    case ControllerProgram::Kind::ardupilot: return "ardupilot";
    case ControllerProgram::Kind::own: break;
  }
  return "own";
}

Json axes_json(const FlightSummary& summary) {
  Json axes = Json::object();
  for (std::size_t i = 0; i < 3; ++i) {
    const AxisResult& a = summary.axes[i];
    axes[std::string(1, "xyz"[i])] = {{"start", rounded(a.start)},
                                      {"end", rounded(a.end)},
                                      {"difference", rounded(a.difference)},
                                      {"expected", rounded(a.expected)},
                                      {"error", rounded(a.error)}};
  }
  return axes;
}

Json wall_json(const WallTime& wall) {
  const LiveCounts& counts = wall.live.counts;
  return {{"rate", wall.rate},
          {"behind_s", rounded(wall.behind_s)},
          {"images", counts.images},
          {"images_dropped", counts.images_dropped},
          {"image_to_estimate_ms", {{"p50", rounded(wall.answer.p50_ms)}, {"p99", rounded(wall.answer.p99_ms)}}}};
}

std::string wall_text(const WallTime& wall) {
  const LiveStatus& live = wall.live;
  return fmt::format(
      "  in wall time at {:g} of its speed, at most {:.2f} s behind; {} of {} images dropped, image to estimate {:.0f} ms (p50), {:.0f} ms (p99)\n",
      wall.rate, wall.behind_s, live.counts.images_dropped, live.counts.images, wall.answer.p50_ms, wall.answer.p99_ms);
}

}  // namespace

std::string flight_text(const FlightFacts& facts, const FlightLog& log, const FlightSummary& s) {
  std::string text =
      fmt::format("{}, preset {}, seed {}, frontend {}: ", facts.mission, facts.preset, facts.seed, facts.frontend);
  if (log.crash) text += fmt::format("CRASH: {}\n", *log.crash);
  else if (log.out_of_time) text += fmt::format("not completed in time, {}\n", to_string(log.mode));
  else if (log.reason != FlightReason::none)
    text += fmt::format("{} by failsafe: {}\n", to_string(log.mode), to_string(log.reason));
  else text += "completed\n";
  if (s.arrived) {
    text += "         start      end  difference  expected  axial error\n";
    for (std::size_t i = 0; i < 3; ++i) {
      const AxisResult& a = s.axes[i];
      text += fmt::format("  {}  {:6.2f} cm {:6.2f} cm {:8.2f} cm {:6.2f} cm {:9.2f} cm\n", "XYZ"[i], 100 * a.start, 100 * a.end,
                          100 * a.difference, 100 * a.expected, 100 * a.error);
    }
    text += fmt::format("  mean axial error {:.2f} cm, distance {:.2f} cm\n", 100 * s.mean_axial_error_m, 100 * s.distance_m);
  }
  text += fmt::format(
      "  {:.1f} s in flight, up to {:.2f} m/s and {:.0f} deg of tilt; RMSE / max: truth to setpoint {:.1f} / {:.1f} cm, "
      "estimate to truth {:.1f} / {:.1f} cm\n",
      s.flown_s, s.top_speed_mps, s.largest_tilt_deg, 100 * s.tracking.rmse, 100 * s.tracking.max, 100 * s.estimation.rmse,
      100 * s.estimation.max);
  if (facts.controller != ControllerProgram::Kind::own)
    text += fmt::format("  {}: {} resets of its estimator in flight\n", name_of(facts.controller), log.controller_resets);
  if (log.wall_time) text += wall_text(*log.wall_time);
  text += "  ";
  for (std::size_t i = 0; i < s.modes.size(); ++i)
    text += fmt::format("{}{} {:.1f} s", i > 0 ? ", " : "", s.modes[i].first, s.modes[i].second);
  return text + "\n";
}

std::string flight_json_text(const FlightFacts& facts, const FlightLog& log, const FlightSummary& s) {
  Json json{{"mission", facts.mission}, {"preset", facts.preset}, {"seed", facts.seed}, {"frontend", facts.frontend}};
  json["vehicle"] = facts.vehicle;
  json["loop"] = facts.loop;
  json["arrived"] = s.arrived;
  json["crash"] = log.crash ? Json(*log.crash) : Json(nullptr);
  json["out_of_time"] = log.out_of_time;
  json["ended"] = to_string(log.mode);
  json["reason"] = to_string(log.reason);
  json["axes_m"] = axes_json(s);
  json["mean_axial_error_m"] = rounded(s.mean_axial_error_m);
  json["distance_m"] = rounded(s.distance_m);
  json["truth_to_setpoint_m"] = to_json(s.tracking);
  json["estimate_to_setpoint_m"] = to_json(s.control);
  json["estimate_to_truth_m"] = to_json(s.estimation);
  json["top_speed_mps"] = rounded(s.top_speed_mps);
  json["largest_tilt_deg"] = rounded(s.largest_tilt_deg);
  json["drift_blind_m"] = rounded(s.drift_blind_m);
  json["mean_thrust"] = rounded(s.mean_thrust);
  json["command_change"] = rounded(s.command_change);
  json["flown_s"] = rounded(s.flown_s);
  json["least_battery_V"] = rounded(s.least_battery_V);
  json["images"] = log.images;
  json["controller"] = name_of(facts.controller);
  json["controller_resets"] = log.controller_resets;
  if (log.wall_time) json["wall_clock"] = wall_json(*log.wall_time);
  json["events"] = Json::array();
  for (const ControllerEvent& event : log.events) json["events"].push_back({rounded(event.t_s), event.text});
  json["modes"] = Json::array();
  for (const auto& [name, seconds] : s.modes) json["modes"].push_back({name, rounded(seconds)});
  return json.dump(1) + "\n";
}

}  // namespace fbvins::app
