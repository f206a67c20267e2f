// SPDX-License-Identifier: Apache-2.0
#include "apps/flight_calibration_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "apps/calibration_report.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/atomic_file.hpp"

namespace fbvins::app {
namespace {

using Json = nlohmann::ordered_json;

const char* word(FlightFinding finding) {
  switch (finding) {
    case FlightFinding::refined: return "refined";
    case FlightFinding::confirmed: return "confirmed";
    case FlightFinding::left: return "left";
    case FlightFinding::not_determined: break;
  }
  return "not determined";
}

/// For people: degrees, mm, ms and per cent.
struct ReadableUnit {
  double factor;
  const char* name;
};
ReadableUnit readable(const std::string& unit) {
  if (unit == "rad") return {1 / kDegree, "degrees"};
  if (unit == "m") return {1e3, "mm"};
  if (unit == "s") return {1e3, "ms"};
  return unit.empty() ? ReadableUnit{100, "%"} : ReadableUnit{1, unit.c_str()};
}

std::string names_of(const FlightCalibration& found, FlightFinding finding) {
  std::vector<std::string> names;
  for (const RefinedParameter& p : found.parameters)
    if (p.finding == finding) names.push_back(p.name);
  return fmt::format("{}", fmt::join(names, " "));
}

Json part_json(const HeldOutPart& part) {
  Json out = {{"name", part.name}, {"changed", part.changed}};
  if (part.changed) out["cost_given"] = part.given, out["cost_refined"] = part.refined, out["gain"] = part.gain;
  return out;
}

}  // namespace

std::string flight_calibration_text(const FlightCalibration& found) {
  std::string out =
      fmt::format("{} pieces of flights, {:.0f} s, {} keyframes, {} points seen {} times; noise {:.2f} px, spread {:.1f}\n",
                  found.pieces, found.duration_s, found.keyframes, found.points, found.views, found.sigma_px, found.spread);
  if (!found.better && !names_of(found, FlightFinding::refined).empty()) out += "what all flights ask for, which is not taken:\n";
  for (const RefinedParameter& p : found.parameters) {
    if (p.finding != FlightFinding::refined) continue;
    const ReadableUnit unit = readable(p.unit);
    out += fmt::format("  {:<12} {:>12.4f} {:>+11.4f} +- {:<9.4f} {}\n", p.name, unit.factor * p.value, unit.factor * p.change,
                       unit.factor * p.sigma, unit.name);
  }
  if (const std::string names = names_of(found, FlightFinding::confirmed); !names.empty())
    out += fmt::format("as given, which these flights confirm: {}\n", names);
  if (const std::string names = names_of(found, FlightFinding::left); !names.empty())
    out += fmt::format("as given, since what was held out is predicted better so: {}\n", names);
  if (const std::string names = names_of(found, FlightFinding::not_determined); !names.empty())
    out += fmt::format("as given, not determined by these flights: {}\n", names);
  for (const HeldOutPart& part : found.held_out)
    out += part.changed ? fmt::format("{}, held out: predicted {} by {:.1f}\n", part.name, part.gain >= 0 ? "better" : "worse",
                                      std::abs(part.gain))
                        : fmt::format("{}, held out: the others change nothing\n", part.name);
  return out + fmt::format("{}: {}\n", found.better ? "refined" : "not refined", found.verdict);
}

std::string flight_calibration_json(const FlightCalibration& found, const std::vector<std::string>& runs) {
  Json out = {{"version", FBVINS_VERSION}, {"runs", runs}, {"better", found.better}, {"verdict", found.verdict}};
  out["duration_s"] = found.duration_s, out["pieces"] = found.pieces, out["keyframes"] = found.keyframes;
  out["points"] = found.points, out["views"] = found.views;
  out["noise_px"] = found.sigma_px, out["spread"] = found.spread;
  out["gyro_noise"] = found.gyro_noise_radps_rthz, out["accel_noise"] = found.accel_noise_mps2_rthz;
  out["parameters"] = Json::object();
  for (const RefinedParameter& p : found.parameters)
    out["parameters"][p.name] = {{"given", p.given},
                                 {"value", p.value},
                                 {"change", p.change},
                                 {"sigma", p.sigma},
                                 {"prior_sigma", p.prior_sigma},
                                 {"finding", word(p.finding)},
                                 {"unit", p.unit}};
  for (Eigen::Index row = 0; row < found.covariance.rows(); ++row)
    out["covariance"].push_back(std::vector<double>(found.covariance.col(row).begin(), found.covariance.col(row).end()));
  out["held_out"] = Json::array();
  for (const HeldOutPart& part : found.held_out) out["held_out"].push_back(part_json(part));
  return out.dump(1) + "\n";
}

Result<void> write_flight_calibration(const FlightCalibration& found, const std::vector<std::string>& runs,
                                      const std::string& folder) {
  std::vector<NamedText> files = rig_files(rig_calibration(found.rig));
  files.insert(files.end(),
               {{"summary.json", flight_calibration_json(found, runs)}, {"calibration.txt", flight_calibration_text(found)}});
  return write_files(folder, files);
}

}  // namespace fbvins::app
