// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/io/output_file.hpp"
#include "fbvins/report/curves.hpp"
#include "fbvins/report/flight_curves.hpp"
#include "fbvins/report/report_page.hpp"
#include "fbvins/report/run_errors.hpp"

namespace fbvins {
namespace {

using Json = nlohmann::ordered_json;

double seconds_since(Time start, Time t) { return (t - start).seconds(); }

/// The estimated states, which need no ground truth.
std::string odometry_curves(const RunFolder& run, std::size_t max_points) {
  std::vector<double> t;
  std::vector<Vec3> p, v, bg, ba, sp, sv, sbg, sba;
  const Vec3 none = Vec3::Constant(NAN);
  for (const Odometry& o : run.odometry) {
    const bool pose = o.health.has_pose();
    t.push_back(seconds_since(run.start(), o.t));
    p.push_back(pose ? o.T_WB.p : none);
    v.push_back(pose ? o.v_WB : none);
    bg.push_back(pose ? o.bias.gyro_radps : none);
    ba.push_back(pose ? o.bias.accel_mps2 : none);
    const Vec3 sigma_p = o.pose_covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt();
    sp.push_back(pose ? sigma_p : none);
    sv.push_back(pose ? Vec3(o.velocity_covariance.diagonal().cwiseMax(0).cwiseSqrt()) : none);
    sbg.push_back(pose ? Vec3(o.gyro_bias_covariance.diagonal().cwiseMax(0).cwiseSqrt()) : none);
    sba.push_back(pose ? Vec3(o.accel_bias_covariance.diagonal().cwiseMax(0).cwiseSqrt()) : none);
  }
  Curves curves(t.size(), max_points);
  curves.add("t", t);
  for (const auto& [name, values] :
       {std::pair{"p", &p}, {"v", &v}, {"bg", &bg}, {"ba", &ba}, {"sp", &sp}, {"sv", &sv}, {"sbg", &sbg}, {"sba", &sba}})
    curves.add(name, *values);
  return curves.text();
}

std::string error_curves(const RunFolder& run, const RunErrors& errors, std::size_t max_points) {
  std::vector<double> t, absolute, degrees;
  std::vector<Vec3> aligned, truth, drift, dv, dbg, dba, sp, sv, sbg, sba;
  for (const FrameError& e : errors.frames) {
    const Odometry& o = run.odometry[e.frame];
    t.push_back(seconds_since(run.start(), o.t));
    absolute.push_back(e.absolute_m);
    degrees.push_back(e.absolute_deg);
    aligned.push_back(e.aligned.p);
    truth.push_back(e.truth.p);
    drift.push_back(e.drift_m);
    sp.emplace_back(o.pose_covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt());
    if (!e.bias_error) continue;
    dv.push_back(e.velocity_error_mps);
    dbg.push_back(e.bias_error->gyro_radps);
    dba.push_back(e.bias_error->accel_mps2);
    sv.emplace_back(o.velocity_covariance.diagonal().cwiseMax(0).cwiseSqrt());
    sbg.emplace_back(o.gyro_bias_covariance.diagonal().cwiseMax(0).cwiseSqrt());
    sba.emplace_back(o.accel_bias_covariance.diagonal().cwiseMax(0).cwiseSqrt());
  }
  Curves curves(t.size(), max_points);
  curves.add("t", t);
  curves.add("absolute_m", absolute);
  curves.add("absolute_deg", degrees);
  for (const auto& [name, values] : {std::pair{"aligned", &aligned},
                                     {"truth", &truth},
                                     {"drift", &drift},
                                     {"dv", &dv},
                                     {"dbg", &dbg},
                                     {"dba", &dba},
                                     {"sp", &sp},
                                     {"sv", &sv},
                                     {"sbg", &sbg},
                                     {"sba", &sba}})
    if (values->size() == t.size()) curves.add(name, *values);  // velocity and biases: only if the truth has them throughout
  return curves.text();
}

std::string table_curves(const RunFolder& run, const CsvTable& table, const std::vector<std::string>& columns,
                         std::size_t max_points) {
  std::vector<double> t;
  for (Time stamp : table.stamps()) t.push_back(seconds_since(run.start(), stamp));
  Curves curves(t.size(), max_points);
  curves.add("t", t);
  for (const std::string& column : columns) curves.add(column, table.numbers(column));
  return curves.text();
}

/// Intervals of equal health: [from s, to s, state, reason].
Json health_stretches(const RunFolder& run) {
  Json stretches = Json::array();
  const std::vector<Odometry>& all = run.odometry;
  for (std::size_t first = 0; first < all.size();) {
    std::size_t end = first + 1;
    while (end < all.size() && all[end].health == all[first].health) ++end;
    const Time to = end < all.size() ? all[end].t : all.back().t;
    stretches.push_back({std::round(1000 * seconds_since(run.start(), all[first].t)) / 1000,
                         std::round(1000 * seconds_since(run.start(), to)) / 1000, to_string(all[first].health.state),
                         to_string(all[first].health.reason)});
    first = end;
  }
  return stretches;
}

Json to_json(const ErrorStatistics& s) {
  return {{"count", s.count}, {"max", s.max}, {"mean", s.mean}, {"median", s.median}, {"rmse", s.rmse}, {"std", s.std}};
}

/// Mean NEES over the run, by quantity.
Json mean_nees(const RunErrors& errors) {
  Json json = Json::object();
  const auto mean = [&](const char* name, double StateNees::*member) {
    double sum = 0;
    int count = 0;
    for (const FrameError& e : errors.frames)
      if (std::isfinite(e.nees.*member)) sum += e.nees.*member, ++count;
    if (count > 0) json[name] = sum / count;
  };
  mean("position", &StateNees::position);
  mean("orientation", &StateNees::orientation);
  mean("velocity", &StateNees::velocity);
  mean("gyro bias", &StateNees::gyro_bias);
  mean("accelerometer bias", &StateNees::accel_bias);
  return json;
}

std::string run_text(const RunFolder& run, const ReportOptions& options) {
  Json head{{"name", run.name}, {"dataset", run.dataset}, {"frontend", run.frontend}, {"version", run.version}};
  head["summary"] = run.summary;
  head["config"] = run.config;
  head["health"] = health_stretches(run);
  RunErrors errors;
  if (!run.truth.empty()) errors = run_errors(run);
  if (errors.evaluation) {
    const Evaluation& e = *errors.evaluation;
    head["table"] = Json{{"absolute_m", to_json(e.absolute_m)},
                         {"absolute_deg", to_json(e.absolute_rotation_deg)},
                         {"per_metre_m", to_json(e.per_metre_m)},
                         {"per_second_m", to_json(e.per_second_m)}};
    head["path_m"] = e.truth_path_m;
    head["nees"] = mean_nees(errors);
  }
  std::string text = json_text(head);
  text.pop_back();  // more members follow
  const std::size_t n = options.max_points;
  text += ",\"odometry\":" + odometry_curves(run, n);
  if (!errors.frames.empty()) text += ",\"errors\":" + error_curves(run, errors, n);
  text += ",\"features\":" +
          table_curves(run, run.statistics,
                       {"tracked", "detected", "stereo", "observations", "landmarks", "outliers", "brightness_left"}, n);
  text += ",\"timing\":" +
          table_curves(run, run.timing,
                       {"pyramid", "track", "stereo", "detect", "geometry", "boost", "prepare", "solve", "marginalise"}, n);
  if (run.flight) text += ",\"flight\":" + flight_text(*run.flight, run.start(), n);
  return text + "}";
}

void replace_once(std::string& text, const std::string& mark, const std::string& with) {
  const std::size_t at = text.find(mark);
  if (at != std::string::npos) text.replace(at, mark.size(), with);
}

/// "</script>" in a value must not end the element that holds it.
std::string inside_script(std::string text) {
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) text.replace(at, 2, "<\\/");
  return text;
}

std::string inside_element(const std::string& text) {
  std::string out;
  for (char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return out;
}

std::string title_of(const std::vector<RunFolder>& runs) {
  std::vector<std::string> datasets;
  for (const RunFolder& run : runs)
    if (std::find(datasets.begin(), datasets.end(), run.dataset) == datasets.end()) datasets.push_back(run.dataset);
  if (datasets.size() > 3) return fmt::format("{} recordings", datasets.size());
  std::string title;
  for (const std::string& dataset : datasets) title += (title.empty() ? "" : ", ") + dataset;
  return title;
}

}  // namespace

std::string report_html(const std::vector<RunFolder>& runs, const Json& bench, const ReportOptions& options) {
  std::string data = fmt::format("{{\"title\":{},\"bench\":{},\"runs\":[", json_text(options.title), json_text(bench));
  for (std::size_t i = 0; i < runs.size(); ++i) data += fmt::format("{}{}", i ? "," : "", run_text(runs[i], options));
  data += "]}";
  std::string page = report_page();
  replace_once(page, "<!--TITLE-->", inside_element(options.title));
  replace_once(page, "<!--DATA-->", inside_script(std::move(data)));
  return page;
}

Result<std::vector<std::string>> write_report(const std::vector<std::string>& folders, const std::string& out,
                                              const std::string& truth, const std::string& title) {
  std::vector<RunFolder> runs;
  std::vector<std::string> warnings;
  for (const std::string& path : folders) {
    Result<RunFolder> run = read_run_folder(path, truth);
    if (!run) return run.error();
    if (run->truth.empty()) warnings.push_back(path + ": no ground truth, so no errors (--truth gives one)");
    runs.push_back(*std::move(run));
  }
  ReportOptions options;
  options.title = title.empty() ? title_of(runs) : title;
  Result<OutputFile> file = OutputFile::create(out);
  if (!file) return file.error();
  file->write(report_html(runs, nullptr, options));
  if (Result<void> done = file->close(); !done) return done.error();
  return warnings;
}

}  // namespace fbvins
