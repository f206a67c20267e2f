// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/flight_curves.hpp"

#include "fbvins/page/curves.hpp"

namespace fbvins {
namespace {

using Json = nlohmann::ordered_json;

/// Intervals of equal mode: [from s, to s, mode, reason].
Json mode_stretches(const CsvTable& rows, const std::vector<double>& t) {
  const std::vector<std::string> mode = rows.texts("mode"), reason = rows.texts("mode_reason");
  Json stretches = Json::array();
  for (std::size_t first = 0; first < mode.size() && mode.size() == reason.size();) {
    std::size_t end = first + 1;
    while (end < mode.size() && mode[end] == mode[first] && reason[end] == reason[first]) ++end;
    const double to = end < mode.size() ? t[end] : t.back();
    stretches.push_back({std::round(1000 * t[first]) / 1000, std::round(1000 * to) / 1000, mode[first], reason[first]});
    first = end;
  }
  return stretches;
}

}  // namespace

std::string flight_text(const FlightFiles& flight, Time start, std::size_t max_points) {
  const CsvTable& rows = flight.rows;
  std::vector<double> t;
  for (Time stamp : rows.stamps()) t.push_back((stamp - start).seconds());
  Curves curves(t.size(), max_points);
  curves.add("t", t);
  for (const char* name : {"true_p", "estimate_p", "setpoint_p", "torque"})
    for (const char* axis : {"_x", "_y", "_z"}) curves.add(std::string(name) + axis, rows.numbers(std::string(name) + axis));
  for (const char* name : {"command_1", "command_2", "command_3", "command_4", "thrust", "battery", "estimate_age"})
    curves.add(name, rows.numbers(name));
  return fmt::format("{{\"summary\":{},\"modes\":{},\"curves\":{}}}", json_text(flight.summary),
                     json_text(mode_stretches(rows, t)), curves.text());
}

}  // namespace fbvins
