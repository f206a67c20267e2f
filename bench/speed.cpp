// SPDX-License-Identifier: Apache-2.0
// CPU time of a stereo frame in frontend and estimator, on one thread and with the images decoded beforehand.
// Prints JSON, of which bench/speed makes tables. There is no warm-up, and nothing is left out or subtracted: every image
// of the recording counts, including those before the first pose and the initialisation.
//
//   fbvins_speed MH_01_easy_17s --set frontend.kind=orb --set estimator.keyframes.max_keyframes=12
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fbvins/config/config_file.hpp"
#include "fbvins/core/stage_timer.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/eval/statistics.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins {
namespace {

using Json = nlohmann::ordered_json;

struct Measured {
  std::vector<double> total_ms;  ///< of each image: everything between its arrival and its pose
  std::vector<FrontendStats> frontend;
  std::vector<EstimatorStats> estimator;
  Trajectory<W> poses;
};

Measured fly(const SystemOptions& config, const StereoRig& rig, std::vector<SensorEvent> events) {
  Measured m;
  System system = *System::create(config, rig);
  system.on_tracked_frame([&](const TrackedFrame& f) { m.frontend.push_back(f.stats); });
  CpuTimer timer;
  double since_pose_ms = 0;  // the time of IMU samples counts for the image that follows them
  bool posed = false;
  system.on_odometry([&](const Odometry& o) {
    m.estimator.push_back(o.stats);
    if (o.health.has_pose()) m.poses.push_back({o.t, o.T_WB});
    posed = true;
  });
  const auto account = [&] {
    since_pose_ms += timer.lap_ms();
    if (!posed) return;
    m.total_ms.push_back(since_pose_ms);
    since_pose_ms = 0;
    posed = false;
  };
  for (SensorEvent& event : events) {
    if (!system.push(std::move(event))) break;  // finish() says why
    account();
  }
  if (Result<void> end = system.finish(); !end) throw std::runtime_error(end.error().message);
  account();
  return m;
}

Json spread(const std::vector<double>& ms) {
  return Json{{"mean", statistics_of(ms).mean}, {"p50", percentile(ms, 0.5)}, {"p99", percentile(ms, 0.99)}};
}

template <class Stats>
Json share(const std::vector<Stats>& stats, double Stats::*member) {
  std::vector<double> ms;
  for (const Stats& s : stats) ms.push_back(s.*member);
  return spread(ms);
}

Json report(const Measured& m, const std::vector<TrajectoryPoint>& truth_points) {
  Json json{{"frames", m.estimator.size()}, {"total_ms", spread(m.total_ms)}};
  std::vector<double> frontend, estimator;
  double features = 0, window = 0;
  for (const FrontendStats& s : m.frontend) frontend.push_back(s.total_ms()), features += s.tracked + s.detected;
  for (const EstimatorStats& s : m.estimator) estimator.push_back(s.total_ms()), window += s.frames_in_window;
  json["frontend_ms"] = spread(frontend);
  json["estimator_ms"] = spread(estimator);
  Json& stages = json["stages"];
  stages["pyramid"] = share(m.frontend, &FrontendStats::pyramid_ms);
  stages["detect"] = share(m.frontend, &FrontendStats::detect_ms);
  stages["track"] = share(m.frontend, &FrontendStats::track_ms);
  stages["geometry"] = share(m.frontend, &FrontendStats::geometry_ms);
  stages["stereo"] = share(m.frontend, &FrontendStats::stereo_ms);
  stages["prepare"] = share(m.estimator, &EstimatorStats::prepare_ms);
  stages["solve"] = share(m.estimator, &EstimatorStats::solve_ms);
  stages["marginalise"] = share(m.estimator, &EstimatorStats::marginalise_ms);
  json["mean_features"] = features / static_cast<double>(std::max<std::size_t>(1, m.frontend.size()));
  json["mean_window_frames"] = window / static_cast<double>(std::max<std::size_t>(1, m.estimator.size()));
  Trajectory<W> truth;
  for (const TrajectoryPoint& point : truth_points) truth.push_back({point.t, point.T_WB});
  if (const auto evaluation = evaluate(truth, m.poses, {})) json["ate_rmse_m"] = evaluation->absolute_m.rmse;
  return json;
}

int run(const std::string& path, const std::string& config_file, const std::vector<std::string>& assignments) {
  const auto config = load_config(config_file, assignments);
  if (!config) return fmt::print(stderr, "{}\n", config.error().message), 1;
  DatasetOptions options;
  options.prefetch_frames = 0;
  const auto data = open_dataset(path, options);
  if (!data) return fmt::print(stderr, "{}\n", data.error().message), 1;
  std::vector<SensorEvent> events;
  while (auto event = (*data)->next()) events.push_back(std::move(*event));
  const Measured measured = fly(*config, (*data)->rig(), std::move(events));
  fmt::print("{}\n", report(measured, (*data)->ground_truth()).dump(2));
  return 0;
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  CLI::App program("CPU time of a stereo frame, images decoded beforehand");
  std::string dataset, config;
  std::vector<std::string> assignments;
  program.add_option("DATASET", dataset, "EuRoC folder or zip")->required();
  program.add_option("--config", config, "YAML file that changes the defaults");
  program.add_option("--set", assignments, "one option, name=value; may be repeated")->take_all()->allow_extra_args(false);
  CLI11_PARSE(program, argc, argv);
  return fbvins::run(dataset, config, assignments);
}
