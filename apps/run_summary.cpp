// SPDX-License-Identifier: Apache-2.0
#include "apps/run_summary.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "fbvins/config/config_file.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/no_pose.hpp"

namespace fbvins::app {
namespace {

/// Counts frames by health, and restarts once a pose has been given, also those after which none was found again.
void count_health(const RunRecord& record, RunSummary& summary) {
  std::map<std::string, int> counts;
  bool had_pose = false;
  std::uint32_t reset_counter = 0;
  for (const Odometry& o : record.odometry) {
    ++counts[label_of(o.health)];
    for (const int camera : cameras_in(o.health.without_cameras)) ++summary.without_cameras[camera];
    if (had_pose && o.reset_counter != reset_counter) ++summary.restarts;
    reset_counter = o.reset_counter;
    had_pose = had_pose || o.health.has_pose();
  }
  summary.health.assign(counts.begin(), counts.end());
}

void evaluate_against(Trajectory<W> truth, const RunRecord& record, RunSummary& summary) {
  if (summary.coverage.with_pose == 0) {
    summary.no_evaluation = no_pose_sentence({summary.health.begin(), summary.health.end()});
    return;
  }
  auto evaluation = evaluate(truth, record.poses(), {});
  if (evaluation) summary.evaluation = *evaluation;
  else summary.no_evaluation = evaluation.error().message;

  AssociationOptions at_the_very_stamps;
  at_the_very_stamps.method = AssociationMethod::interpolate_truth;
  const std::vector<PosePair> pairs = associate(std::move(truth), record.poses(), at_the_very_stamps);
  std::vector<Mat6> covariances;  // both are in order of time; estimates beyond the truth have no pair
  for (const Odometry& o : record.odometry)
    if (covariances.size() < pairs.size() && o.health.has_pose() && o.t == pairs[covariances.size()].estimate.t)
      covariances.push_back(o.pose_covariance);
  if (const auto start = align_start(pairs)) summary.nees = nees(pairs, covariances, *start);
  if (const auto start = align_start_levelled(pairs)) {
    summary.nees_levelled = nees(pairs, covariances, start->to_truth);
    summary.truth_level = *start;
  }
}

Json adjustment_json(const FinalAdjustmentReport& a) {
  const auto plausibility = [](const Plausibility& p) {
    return Json{{"held_out", p.held_out}, {"imu", p.imu}, {"odometry", p.odometry}};
  };
  Json json{{"points", a.points},
            {"observations", a.observations},
            {"initial_rms_px", a.initial_rms_px},
            {"final_rms_px", a.final_rms_px},
            {"before", plausibility(a.before)},
            {"after", plausibility(a.after)},
            {"tilt_rad", a.tilt_rad}};
  if (!a.refused.empty()) json["refused"] = a.refused;
  return json;
}

Json map_json(const MapSummary& m) {
  Json json{{"keyframes", m.keyframes}, {"keyframes_in_map", m.keyframes_in_map}, {"loops", m.loops}};
  if (!m.loaded.empty()) json["found_in_loaded_map"] = m.localised_after_s.has_value();
  json["refused"] = m.refused;
  json["left_out"] = m.left_out;
  if (m.anchored_after_s || m.anchors_refused > 0)
    json["anchors"] = {{"used", m.anchors}, {"refused", m.anchors_refused}, {"left_out", m.anchors_left_out}};
  if (m.anchored_after_s) json["anchored_after_s"] = *m.anchored_after_s;
  if (m.localised_after_s) json["localised_after_s"] = *m.localised_after_s;
  for (const MapSummary::Found& f : m.found_again)
    json["found_again"].push_back({{"restart_s", f.restart_s}, {"after_s", f.after_s}});
  for (const auto& [session, why] : m.not_joined) json["not_joined"].push_back({{"session", session}, {"why", why}});
  if (m.causal) json["causal"] = to_json(*m.causal, Alignment::se3);
  if (m.bounded) json["bounded"] = to_json(*m.bounded, Alignment::se3);
  if (m.final) json["after_the_run"] = to_json(*m.final, Alignment::se3);
  if (m.adjusted) json["after_final_ba"] = to_json(*m.adjusted, Alignment::se3);
  if (m.adjustment) json["final_ba"] = adjustment_json(*m.adjustment);
  return json;
}

std::string map_text(const MapSummary& m) {
  std::string text = fmt::format("map: {} keyframes of {}, {} loops, {} refused by the odometry, {} left out by the graph\n",
                                 m.keyframes_in_map, m.keyframes, m.loops, m.refused, m.left_out);
  if (!m.loaded.empty())
    text += m.localised_after_s
                ? fmt::format("map: the flight was found in {} {:.1f} s after its first pose\n", m.loaded, *m.localised_after_s)
                : fmt::format("map: the flight was never found in {}: its poses in M are not known\n", m.loaded);
  else if (!m.localised_after_s) text += "map: never localised\n";
  for (const MapSummary::Found& f : m.found_again)
    text += fmt::format("map: found again {:.1f} s after the restart at {:.1f} s\n", f.after_s, f.restart_s);
  for (const auto& [session, why] : m.not_joined) text += fmt::format("map: session {} is no part of it: {}\n", session, why);
  if (m.anchored_after_s)
    text += fmt::format(
        "map: in the building's frame after {:.1f} s, {} anchors, {} refused by the odometry, {} left out by the graph\n",
        *m.anchored_after_s, m.anchors, m.anchors_refused, m.anchors_left_out);
  const auto line = [&](const char* what, const std::optional<Evaluation>& e) {
    if (e) text += fmt::format("ATE RMSE in M, {:<38}{:8.4f} m\n", what, e->absolute_m.rmse);
  };
  line("as known at each moment:", m.causal);
  line("the same, moved without steps:", m.bounded);
  line("after the run:", m.final);
  line("after bundle adjustment:", m.adjusted);
  if (m.adjustment)
    text += fmt::format("final bundle adjustment: {} points, {} observations, {:.2f} -> {:.2f} px\n", m.adjustment->points,
                        m.adjustment->observations, m.adjustment->initial_rms_px, m.adjustment->final_rms_px);
  if (m.adjustment && !m.adjustment->refused.empty())
    text += fmt::format("final bundle adjustment refused, the map is as after the run: {}\n", m.adjustment->refused);
  return text;
}

Json timing_json(const std::vector<double>& ms) {
  return Json{{"mean", statistics_of(ms).mean}, {"p50", percentile(ms, 0.5)}, {"p99", percentile(ms, 0.99)}};
}

std::string timing_line(std::string_view name, const std::vector<double>& ms) {
  return fmt::format("{:<12}{:7.2f} ms CPU a frame, p50 {:.2f}, p99 {:.2f}\n", name, statistics_of(ms).mean, percentile(ms, 0.5),
                     percentile(ms, 0.99));
}

std::vector<double> total_ms(const RunSummary& s) {
  std::vector<double> total = s.frontend_ms;
  for (std::size_t i = 0; i < std::min(total.size(), s.estimator_ms.size()); ++i) total[i] += s.estimator_ms[i];
  return total;
}

}  // namespace

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

std::string label_of(const Health& health) {
  if (health.reason == HealthReason::none) return std::string(to_string(health.state));
  return fmt::format("{}/{}", to_string(health.state), to_string(health.reason));
}

double time_offset_found_s(const RunRecord& record) {
  const auto& odometry = record.odometry;
  const auto poses = std::ranges::count_if(odometry, [](const Odometry& o) { return o.health.has_pose(); });
  const auto good = std::ranges::count_if(odometry, [](const Odometry& o) { return o.health.state == HealthState::good; });
  return good == 0 || 2 * good < poses ? 0 : odometry.back().time_offset_s;
}

Trajectory<W> truth_of(const Dataset& data, double found_s) {
  const Duration offset = Duration::from_seconds(data.rig().time_offset_s + found_s);
  Trajectory<W> truth;
  for (const TrajectoryPoint& point : data.ground_truth()) truth.push_back({point.t - offset, point.T_WB});
  return truth;
}

RunSummary summarise(const RunRecord& record, const Dataset& data) {
  std::vector<Time> images;
  for (const FrameEntry& frame : data.frames()) images.push_back(frame.t);
  RunSummary s = summarise(record, std::move(images), truth_of(data, time_offset_found_s(record)));
  s.dataset = data.info().name;
  for (const auto& camera : data.info().cameras) s.images_bad += camera.images.bad();
  return s;
}

RunSummary summarise(const RunRecord& record, std::vector<Time> images, const Trajectory<W>& truth) {
  RunSummary s;
  s.frames = static_cast<int>(record.tracked.size());
  std::vector<Time> poses;
  for (const StampedPose<W>& pose : record.poses()) poses.push_back(pose.t);
  s.coverage = coverage_of(std::move(images), std::move(poses));
  count_health(record, s);
  s.time_offset_found_s = time_offset_found_s(record);
  if (!truth.empty()) evaluate_against(truth, record, s);
  else s.no_evaluation = "the recording holds no ground truth";
  for (const TrackedRecord& tracked : record.tracked) {
    s.frontend_ms.push_back(tracked.stats.total_ms());
    s.boost_ms.push_back(tracked.stats.boost_ms);
    s.matches += tracked.stats.matches;
    s.raw_matches += tracked.stats.raw_matches;
    s.survival += tracked.survival;
  }
  for (const Odometry& o : record.odometry) s.estimator_ms.push_back(o.stats.total_ms());
  s.peak_memory_mb = peak_memory_mb();
  return s;
}

Json to_json(const RefinedCalibration& refined) {
  Json json = Json::object();
  if (refined.time_offset_s) json["time_offset_s"] = *refined.time_offset_s;
  if (refined.line_delay_s) json["line_delay_us"] = 1e6 * *refined.line_delay_s;
  for (std::size_t i = 0; i < refined.T_BC.size(); ++i) {
    const Pose<B, C0>& T = refined.T_BC[i];
    json[fmt::format("T_BC{}", i)] = {{"q", {T.q.w(), T.q.x(), T.q.y(), T.q.z()}}, {"p", {T.p.x(), T.p.y(), T.p.z()}}};
  }
  return json;
}

std::string to_json_text(const RunSummary& s) {
  Json result{{"version", FBVINS_VERSION}, {"dataset", s.dataset}, {"frontend", s.frontend}, {"frames", s.frames}};
  if (!s.booster_weights.empty()) result["booster_weights"] = std::filesystem::path(s.booster_weights).filename().string();
  result["images_bad"] = s.images_bad;
  result["coverage"] = to_json(s.coverage);
  result["restarts"] = s.restarts;
  result["health"] = Json::object();
  for (const auto& [name, frames] : s.health) result["health"][name] = frames;
  if (s.evaluation) result["accuracy"] = to_json(*s.evaluation, Alignment::se3);
  else result["no_accuracy"] = s.no_evaluation;
  if (s.nees) result["nees_from_start"] = to_json(*s.nees);
  if (s.nees_levelled) {
    result["nees_truth_levelled"] = to_json(*s.nees_levelled);
    const Similarity& start = s.truth_level.to_truth;
    result["nees_truth_levelled"]["truth_tilt_rad"] = s.truth_level.truth_tilt_rad;
    result["nees_truth_levelled"]["to_truth"] = {{"q", {start.q.w(), start.q.x(), start.q.y(), start.q.z()}},
                                                 {"p", {start.p.x(), start.p.y(), start.p.z()}}};
  }
  if (s.matches.found > 0)
    result["descriptor_matches"] = {{"found", s.matches.found},
                                    {"inliers", s.matches.inliers},
                                    {"raw_found", s.raw_matches.found},
                                    {"raw_inliers", s.raw_matches.inliers}};
  result["features_in_sight_a_second_later"] = {{"then", s.survival.then}, {"now", s.survival.now}};
  if (s.map) result["map"] = map_json(*s.map);
  if (s.refined) result["refined_calibration"] = to_json(*s.refined);
  Json timing{{"mode", s.mode}, {"wall_s", s.wall_s}};
  timing["frontend_ms"] = timing_json(s.frontend_ms);
  timing["boost_ms"] = timing_json(s.boost_ms);
  timing["estimator_ms"] = timing_json(s.estimator_ms);
  timing["total_ms"] = timing_json(total_ms(s));
  if (s.map)
    timing["loop_ms"] = Json{{"keyframe_mean", s.map->mean_ms}, {"finish", s.map->finish_ms}, {"final_ba", s.map->adjust_ms}};
  timing["peak_memory_mb"] = s.peak_memory_mb;
  return Json{{"result", result}, {"timing", timing}}.dump(2) + "\n";
}

std::string to_text(const RunSummary& s) {
  std::string text = fmt::format("{} with {} (fbvins " FBVINS_VERSION ")\n", s.dataset, s.frontend);
  if (!s.booster_weights.empty()) text += fmt::format("booster weights {}\n", s.booster_weights);
  text += to_line(s.coverage);
  text += fmt::format("restarts {}, frames by health:", s.restarts);
  for (const auto& [name, frames] : s.health) text += fmt::format(" {} {}", name, frames);
  for (const auto& [camera, frames] : s.without_cameras) text += fmt::format(", {} without camera {}", frames, camera);
  text += s.images_bad > 0 ? fmt::format("\n{} image files could not be used\n", s.images_bad) : "\n";
  if (std::abs(s.time_offset_found_s) > 0.5e-3)
    text += fmt::format("time offset: {:+.1f} ms more than the calibration's, found in flight{}\n", 1e3 * s.time_offset_found_s,
                        s.evaluation ? " and applied to the ground truth" : "");
  text += s.evaluation ? to_table(*s.evaluation, Alignment::se3) : fmt::format("no accuracy: {}\n", s.no_evaluation);
  if (s.nees && s.nees->count > 0)
    text += fmt::format(
        "NEES (from the first second on; 3, 3, 6 when consistent): position {:.1f}, orientation {:.1f}, pose {:.1f}\n",
        s.nees->mean.position, s.nees->mean.orientation, s.nees->mean.pose);
  if (s.nees_levelled && s.nees_levelled->count > 0)
    text += fmt::format(
        "NEES without the truth's own constant tilt of {:.2f} deg: position {:.1f}, orientation {:.1f}, pose {:.1f}\n",
        s.truth_level.truth_tilt_rad / kDegree, s.nees_levelled->mean.position, s.nees_levelled->mean.orientation,
        s.nees_levelled->mean.pose);
  if (s.map) text += map_text(*s.map);
  text += "-- timing (differs from run to run) --\n";
  text +=
      timing_line("frontend", s.frontend_ms) + timing_line("estimator", s.estimator_ms) + timing_line("together", total_ms(s));
  if (s.map)
    text += fmt::format("loop closure{:7.2f} ms CPU a keyframe, {:.0f} ms at the end, {:.1f} s bundle adjustment\n",
                        s.map->mean_ms, s.map->finish_ms, s.map->adjust_ms / 1000);
  text += fmt::format("wall {:.1f} s ({}), peak memory {:.0f} MB\n", s.wall_s, s.mode, s.peak_memory_mb);
  return text;
}

Result<void> write_summary(const RunSummary& summary, const Config& config, const std::string& folder) {
  return write_files(
      folder, {{"config.yaml", to_yaml(config)}, {"summary.json", to_json_text(summary)}, {"summary.txt", to_text(summary)}});
}

}  // namespace fbvins::app
