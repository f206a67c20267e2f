// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/bench_results.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "fbvins/core/machine.hpp"
#include "fbvins/core/text.hpp"
#include "fbvins/experiment/bench_runner.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kHeader =
    "cell,dataset,seed,frontend,configuration,repetition,status,max_m,mean_m,median_m,rmse_m,std_m,rotation_rmse_deg,"
    "per_metre_rmse_m,coverage,first_pose_s,restarts,lost_frames,nees_position,nees_orientation,nees_velocity,nees_gyro_bias,"
    "nees_accel_bias,cpu_ms,cpu_p99_ms,peak_mb,trajectory_hash";

double number_at(const Json& json, const char* group, const char* name) {
  if (!json.contains(group) || !json[group].contains(name) || !json[group][name].is_number()) return NAN;
  return json[group][name].get<double>();
}

void take_nees(const RunFolder& run, const RunErrors& errors, CellResult& result) {
  for (const FrameError& e : errors.frames)
    result.nees_over_time.emplace_back((run.odometry[e.frame].t - run.start()).seconds(), e.nees);
  for (double StateNees::*member :
       {&StateNees::position, &StateNees::orientation, &StateNees::velocity, &StateNees::gyro_bias, &StateNees::accel_bias}) {
    double sum = 0;
    int count = 0;
    for (const FrameError& e : errors.frames)
      if (std::isfinite(e.nees.*member)) sum += e.nees.*member, ++count;
    result.nees.*member = count > 0 ? sum / count : NAN;
  }
}

void take_summary(const Json& summary, CellResult& result) {
  const Json& r = summary["result"];
  result.coverage = number_at(r, "coverage", "share");
  result.first_pose_after_s = number_at(r, "coverage", "first_pose_after_s");
  result.restarts = r.value("restarts", 0);
  if (r.contains("health"))
    for (const auto& [name, frames] : r["health"].items())
      if (name.starts_with("lost")) result.lost_frames += frames.get<int>();
  if (!summary.contains("timing")) return;
  result.cpu_ms = number_at(summary["timing"], "total_ms", "mean");
  result.cpu_p99_ms = number_at(summary["timing"], "total_ms", "p99");
  result.peak_mb = summary["timing"].value("peak_memory_mb", 0.0);
}

/// FNV-1a, 64 bits.
std::string hash_of_file(const std::string& path) {
  Result<std::string> text = read_file(path, std::uint64_t{1} << 30u);
  std::uint64_t h = 14695981039346656037ULL;
  if (text)
    for (char c : *text) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return fmt::format("{:016x}", h);
}

CellResult read_cell(const Plan& plan, const Cell& cell, const std::string& out) {
  CellResult result;
  result.cell = cell;
  result.recording = plan.recordings[cell.recording];
  result.status = "failed";
  const std::string folder = cell_folder(out, cell);
  Result<RunFolder> run = read_run_folder(folder);
  if (!run) return result;
  result.version = run->version;
  result.config = run->config;
  result.trajectory_hash = hash_of_file(folder + "/trajectory.csv");
  take_summary(run->summary, result);
  result.status = result.coverage > 0 ? "ok" : "no pose";
  if (run->truth.empty()) {
    result.status = "no truth";
    return result;
  }
  const RunErrors errors = run_errors(*run);
  result.evaluation = errors.evaluation;
  take_nees(*run, errors, result);
  return result;
}

std::string value(double x) { return std::isfinite(x) ? fmt::format("{:.6g}", x) : ""; }

}  // namespace

std::vector<CellResult> read_results(const Plan& plan, const std::string& out) {
  std::vector<CellResult> results;
  for (const Cell& cell : plan.cells) results.push_back(read_cell(plan, cell, out));
  return results;
}

std::string results_csv(const std::vector<CellResult>& results) {
  std::string text = fmt::format("{}\n", kHeader);
  for (const CellResult& r : results) {
    const Evaluation e = r.evaluation.value_or(Evaluation{});
    text += fmt::format("{},{},{},{},{},{},{}", r.cell.id, r.recording.dataset, r.recording.seed, r.cell.frontend,
                        r.cell.configuration.name, r.cell.repetition, r.status);
    for (double x : {e.absolute_m.max, e.absolute_m.mean, e.absolute_m.median, e.absolute_m.rmse, e.absolute_m.std,
                     e.absolute_rotation_deg.rmse, e.per_metre_m.rmse})
      text += fmt::format(",{}", r.evaluation ? value(x) : "");
    text += fmt::format(",{},{},{},{}", value(r.coverage), value(r.first_pose_after_s), r.restarts, r.lost_frames);
    for (double x : {r.nees.position, r.nees.orientation, r.nees.velocity, r.nees.gyro_bias, r.nees.accel_bias})
      text += fmt::format(",{}", r.nees_over_time.empty() ? "" : value(x));
    text += fmt::format(",{},{},{},{}\n", value(r.cpu_ms), value(r.cpu_p99_ms), value(r.peak_mb), r.trajectory_hash);
  }
  return text;
}

Json results_json(const std::string& title, const std::vector<CellResult>& results) {
  Json json{{"title", title}, {"machine", describe_machine()}};
  std::set<std::string> versions;
  Json cells = Json::array();
  for (const CellResult& r : results) {
    if (!r.version.empty()) versions.insert(r.version);
    Json cell{{"cell", r.cell.id},
              {"dataset", r.recording.dataset},
              {"recording", r.recording.rendered ? "rendered" : "real"},
              {"seed", r.recording.seed},
              {"frontend", r.cell.frontend},
              {"configuration", r.cell.configuration.name},
              {"repetition", r.cell.repetition},
              {"status", r.status}};
    if (r.evaluation) {
      const ErrorStatistics& a = r.evaluation->absolute_m;
      cell["absolute_m"] = {{"max", a.max},   {"mean", a.mean}, {"median", a.median},
                            {"rmse", a.rmse}, {"std", a.std},   {"count", a.count}};
    }
    cell["coverage"] = r.coverage;
    cell["restarts"] = r.restarts;
    cell["lost_frames"] = r.lost_frames;
    if (!r.nees_over_time.empty())
      cell["nees"] = {{"position", r.nees.position},
                      {"orientation", r.nees.orientation},
                      {"velocity", r.nees.velocity},
                      {"gyro_bias", r.nees.gyro_bias},
                      {"accel_bias", r.nees.accel_bias}};
    cell["timing"] = {{"cpu_ms", r.cpu_ms}, {"cpu_p99_ms", r.cpu_p99_ms}, {"peak_memory_mb", r.peak_mb}};
    cell["effective_configuration"] = r.config;
    cells.push_back(std::move(cell));
  }
  json["versions"] = versions;
  json["cells"] = std::move(cells);
  return json;
}

Result<std::map<std::string, Reference>> read_reference(const std::string& path) {
  Result<std::string> text = read_file(path, 1u << 28u);
  if (!text) return text.error();
  std::map<std::string, Reference> reference;
  std::map<std::string, std::size_t> column;
  for (std::size_t from = 0; from < text->size();) {
    const std::size_t end = std::min(text->find('\n', from), text->size());
    const std::vector<std::string> fields = split(trim(std::string_view(*text).substr(from, end - from)), ',');
    from = end + 1;
    if (column.empty()) {
      for (std::size_t i = 0; i < fields.size(); ++i) column[fields[i]] = i;
      for (const char* needed : {"cell", "rmse_m", "coverage", "restarts"})
        if (!column.count(needed)) return Error{ErrorCode::malformed, fmt::format("{}: the column {} is missing", path, needed)};
      continue;
    }
    if (fields.size() < column.size()) continue;
    const auto number = [&](const char* name) { return parse_double(fields[column[name]]).value_or(NAN); };
    reference[fields[column["cell"]]] = {number("rmse_m"), number("coverage"), number("restarts")};
  }
  return reference;
}

std::vector<Regression> regressions(const std::vector<CellResult>& results, const std::map<std::string, Reference>& reference,
                                    const Tolerance& tolerance) {
  std::vector<Regression> found;
  for (const CellResult& r : results) {
    const auto at = reference.find(r.cell.id);
    if (at == reference.end()) continue;
    const Reference& was = at->second;
    if (std::isfinite(was.rmse_m)) {
      const double limit = was.rmse_m * (1 + tolerance.share) + tolerance.floor_m;
      if (!r.evaluation)
        found.push_back({r.cell.id, fmt::format("no error to compare ({}), was {:.4f} m", r.status, was.rmse_m)});
      else if (r.evaluation->absolute_m.rmse > limit)
        found.push_back({r.cell.id, fmt::format("RMSE {:.4f} m, was {:.4f}, limit {:.4f}", r.evaluation->absolute_m.rmse,
                                                was.rmse_m, limit)});
    }
    if (r.coverage < was.coverage - tolerance.coverage)
      found.push_back({r.cell.id, fmt::format("coverage {:.1f} %, was {:.1f}", 100 * r.coverage, 100 * was.coverage)});
    if (r.restarts > was.restarts) found.push_back({r.cell.id, fmt::format("{} restarts, were {}", r.restarts, was.restarts)});
  }
  return found;
}

}  // namespace fbvins
