// SPDX-License-Identifier: Apache-2.0
#include "apps/live_summary.hpp"

#include <fmt/format.h>

#include "apps/evaluation_report.hpp"
#include "apps/imu_state.hpp"
#include "apps/run_summary.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/live/replay_source.hpp"

namespace fbvins::app {
namespace {

class TotalsSink final : public Sink {
 public:
  TotalsSink(LiveTotals& totals, double rig_time_offset_s) : totals_(totals), rig_time_offset_s_(rig_time_offset_s) {}
  std::string_view name() const override { return "totals"; }
  Result<void> take(const LiveEvent& event) override {
    if (const auto* pose = std::get_if<LivePose>(&event)) totals_.live_poses += pose->health.has_pose() ? 1 : 0;
    const auto* o = std::get_if<Odometry>(&event);
    if (o == nullptr) return {};
    totals_.with_pose += o->health.has_pose() ? 1 : 0;
    ++totals_.health[label_of(o->health)];
    if (auto state = imu_state_of(*o, rig_time_offset_s_)) totals_.imu_state = state;
    return {};
  }

 private:
  LiveTotals& totals_;
  double rig_time_offset_s_;
};

std::optional<Evaluation> accuracy(const Trajectory<W>& truth, const std::string& path) {
  const auto file = read_trajectory(path);
  if (!file) return std::nullopt;
  const auto evaluation = evaluate(truth, file->poses(), {});
  return evaluation ? std::optional(*evaluation) : std::nullopt;
}

Json to_json(const LatencySummary& s) {
  return Json{{"p50", s.p50_ms}, {"p99", s.p99_ms}, {"max", s.max_ms}, {"count", s.count}};
}

std::string line(const char* what, const LatencySummary& s) {
  return fmt::format("{:<34} p50 {:6.1f} ms, p99 {:6.1f} ms, longest {:7.1f} ms\n", what, s.p50_ms, s.p99_ms, s.max_ms);
}

}  // namespace

std::unique_ptr<Sink> LiveTotals::make_sink(double rig_time_offset_s) {
  return std::make_unique<TotalsSink>(*this, rig_time_offset_s);
}

LiveSummary summarise(const LiveTotals& totals, const std::string& source_name, const std::string& frontend, const Source& source,
                      const std::string& folder) {
  LiveSummary s{totals, source_name, frontend, {}, {}, peak_memory_mb()};
  const auto* replay = dynamic_cast<const ReplaySource*>(&source);
  if (replay == nullptr || !replay->dataset().has_ground_truth() || folder.empty()) return s;
  const Trajectory<W> truth = truth_of(replay->dataset());
  s.at_images = accuracy(truth, folder + "/trajectory_tum.txt");
  s.at_imu_rate = accuracy(truth, folder + "/live_tum.txt");
  return s;
}

std::string to_json_text(const LiveSummary& s) {
  Json result{{"version", FBVINS_VERSION}, {"source", s.source}, {"frontend", s.frontend}};
  result["health"] = Json::object();
  for (const auto& [name, images] : s.totals.health) result["health"][name] = images;
  if (s.at_images) result["accuracy"] = to_json(*s.at_images, Alignment::se3);
  if (s.at_imu_rate) result["accuracy_at_imu_rate"] = to_json(*s.at_imu_rate, Alignment::se3);
  Json live;
  s.totals.last.counts.visit([&](const char* name, std::int64_t count) { live[name] = count; });
  live["images_with_pose"] = s.totals.with_pose;
  live["live_poses"] = s.totals.live_poses;
  live["shutter_to_pose_ms"] = to_json(s.totals.last.shutter_to_pose);
  live["pose_age_ms"] = to_json(s.totals.last.pose_age);
  live["peak_memory_mb"] = s.peak_memory_mb;
  return Json{{"result", result}, {"live", live}}.dump(2) + "\n";
}

std::string to_text(const LiveSummary& s) {
  const LiveCounts& c = s.totals.last.counts;
  std::string text = fmt::format("{} with {} (fbvins " FBVINS_VERSION ")\n", s.source, s.frontend);
  text += fmt::format(
      "images {}, with a pose {}, dropped {}, incomplete {}; IMU readings {}, late {}; clock jumps {}, restarts {}\n", c.images,
      s.totals.with_pose, c.images_dropped, c.images_incomplete, c.imu, c.imu_late, c.clock_leaps, c.resets);
  if (c.clock_leaps > 0)
    text +=
        fmt::format("the sensors' clock was set, wrapped or began again {} x: its stamps are continued by this machine's clock\n",
                    c.clock_leaps);
  if (c.clock_set_back > 0)
    text += fmt::format(
        "of these it was set back, or began again, {} x: what it says of the time that passed is not known, so the estimate began anew\n",
        c.clock_set_back);
  if (c.events_lost > 0) text += fmt::format("events that a slow output did not get: {}\n", c.events_lost);
  text += "images by health:";
  for (const auto& [name, images] : s.totals.health) text += fmt::format(" {} {}", name, images);
  text += "\n" + line("from the image's stamp to its pose:", s.totals.last.shutter_to_pose);
  text += line("age of the newest estimate:", s.totals.last.pose_age);
  if (s.at_images) text += "at images:\n" + to_table(*s.at_images, Alignment::se3);
  if (s.at_imu_rate) text += fmt::format("ATE RMSE at IMU rate {:.4f} m\n", s.at_imu_rate->absolute_m.rmse);
  return text + fmt::format("peak memory {:.0f} MB\n", s.peak_memory_mb);
}

}  // namespace fbvins::app
