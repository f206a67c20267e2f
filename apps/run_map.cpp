// SPDX-License-Identifier: Apache-2.0
#include "apps/run_map.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/core/stage_timer.hpp"
#include "fbvins/io/anchor_file.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/loop/map_frame.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kUpdatesHeader =
    "#timestamp [ns],frame,applies_from,localised,session,x [m],y [m],z [m],yaw [rad],keyframes,candidates,accepted,refused,"
    "optimised,anchors,anchors_refused,anchored,M_moved,moved_x [m],moved_y [m],moved_z [m],moved_qw,moved_qx,moved_qy,moved_qz\n";

/// One row of map_updates.csv; where M did not move, the identity.
std::string row_of(const MapUpdate& u) {
  const Pose<M, M> moved = u.M_moved.value_or(Pose<M, M>{});
  return fmt::format(
      "{},{},{},{},{},{:.9f},{:.9f},{:.9f},{:.9f},{},{},{},{},{},{},{},{},{},{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f}\n",
      u.t.ns, u.frame.value, u.applies_from.value, u.localised ? 1 : 0, u.map_session, u.T_MW.p.x(), u.T_MW.p.y(), u.T_MW.p.z(),
      yaw_of(u.T_MW.q), u.stats.keyframes, u.stats.candidates, u.stats.accepted, u.stats.refused, u.stats.optimised ? 1 : 0,
      u.stats.anchors, u.stats.anchors_refused, u.anchored ? 1 : 0, u.M_moved ? 1 : 0, moved.p.x(), moved.p.y(), moved.p.z(),
      moved.q.w(), moved.q.x(), moved.q.y(), moved.q.z());
}

Result<void> check_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  if (std::filesystem::is_directory(folder)) return {};
  return Error{ErrorCode::unwritable, fmt::format("{}: there is no folder {}", path, folder.string())};
}

/// T_MB of every frame that has a pose, with the update that was known when the frame came.
/// Where M becomes the building's frame, the poses begin anew; where it is levelled, those of before are turned with it.
/// Before the first update a new map begins where the odometry began, and is level; in an old one the flight has to be localised.
void compose_causal(const RunRecord& run, bool new_map, MapRecord& record) {
  MapUpdate begin;
  begin.localised = new_map;
  const MapUpdate* now = &begin;
  auto next = record.updates.begin();
  for (const Odometry& o : run.odometry) {
    for (; next != record.updates.end() && next->applies_from <= o.id; ++next) {
      now = &*next;
      if (!now->M_moved) continue;
      if (now->anchored) record.causal.clear(), record.bounded.clear();
      for (StampedPose<M>& p : record.causal) p.T = *now->M_moved * p.T;
    }
    if (now == &begin) {
      begin.reset_counter = o.reset_counter;
      begin.T_MG = {o.gauge.q_LG, Vec3::Zero()};
    }
    if (!o.health.has_pose() || !now->localised || now->reset_counter != o.reset_counter) continue;
    record.causal.push_back({o.t, now->T_MG * o.gauge.T_GB});
    record.bounded.push_back({o.t, now->T_MW_smooth * o.T_WB});
  }
}

/// Each restart begins a new gauge frame: the parts between restarts are corrected one by one.
Trajectory<M> corrected(const LoopMap& map, const RunRecord& run) {
  Trajectory<M> all;
  Trajectory<G> part;
  std::uint32_t reset_counter = 0;
  const auto flush = [&] {
    const Trajectory<M> done = map.corrected(part);
    all.insert(all.end(), done.begin(), done.end());
    part.clear();
  };
  for (const Odometry& o : run.odometry) {
    if (!o.health.has_pose()) continue;
    if (o.reset_counter != reset_counter) flush(), reset_counter = o.reset_counter;
    part.push_back({o.t, o.gauge.T_GB});
  }
  flush();
  return all;
}

Result<void> write_tum(const Trajectory<M>& trajectory, const std::string& path) {
  auto tum = TumWriter::create(path);
  if (!tum) return tum.error();
  for (const StampedPose<M>& p : trajectory) tum->write(p.t, p.T);
  return tum->close();
}

std::optional<Evaluation> evaluated(const Trajectory<W>& truth, const Trajectory<M>& estimate) {
  if (truth.empty()) return std::nullopt;
  const auto evaluation = evaluate(truth, estimate, {});
  return evaluation ? std::optional(*evaluation) : std::nullopt;
}

/// After restarts of the odometry.
std::vector<MapSummary::Found> found_again(const MapRecord& record, const RunRecord& run) {
  std::map<std::uint32_t, Time> began;  // first poses, by reset counter
  for (const Odometry& o : run.odometry)
    if (o.health.has_pose()) began.emplace(o.reset_counter, o.t);
  std::vector<MapSummary::Found> found;
  if (began.empty()) return found;
  const auto& [first, t0] = *began.begin();
  for (const MapUpdate& u : record.updates)
    if (const auto at = began.find(u.reset_counter); u.found && at != began.end() && at->first != first)
      found.push_back({(at->second - t0).seconds(), (u.t - at->second).seconds()});
  return found;
}

}  // namespace

void MapArguments::add_to(CLI::App& command) {
  command.add_flag("--loop", loop, "loop closure: a map beside the odometry");
  command.add_option("--save-map", save, "file for the map at the end; with loop closure");
  command.add_option("--load-map", load, "map to relocalise in and extend; with loop closure");
  command.add_option("--tags", tags,
                     "YAML of AprilTags, at known places in the building or anywhere; with loop closure (docs/maps.md)");
  command.add_option("--vocabulary", vocabulary, "vocabulary file for loop closure, instead of the one that ships");
}

Result<std::unique_ptr<LoopMap>> make_map(const MapArguments& arguments, const StereoRig& rig, const LoopOptions& options) {
  if (!arguments.wanted()) return std::unique_ptr<LoopMap>();
  if (!arguments.save.empty())
    if (Result<void> there = check_folder_of(arguments.save); !there) return there.error();
  auto map = LoopMap::create(
      rig, {.file = arguments.load, .vocabulary = arguments.vocabulary, .boosted = arguments.boosted, .loop = options});
  if (!map || arguments.load.empty()) return map;
  const int loaded = (*map)->keyframes();
  if (loaded == 0)
    warn(fmt::format(
        "{}: a map without keyframes; of a map that was kept in flight they are in {}.journal, which is to be copied with it",
        arguments.load, arguments.load));
  if (loaded > options.max_keyframes)
    warn(fmt::format("{}: {} keyframes, and loop.max_keyframes is {}: at the end of the flight the map keeps so many",
                     arguments.load, loaded, options.max_keyframes));
  return map;
}

Result<std::vector<Anchor>> positions_of(const MapArguments& arguments) {
  if (arguments.positions.empty()) return std::vector<Anchor>{};
  return read_anchors(arguments.positions);
}

void finish_map(const MapArguments& arguments, LoopMap& map, const RunRecord& run, MapRecord& record) {
  compose_causal(run, arguments.load.empty(), record);
  CpuTimer timer;
  record.graph = map.finish();
  record.finish_ms = timer.lap_ms();
  record.keyframes_in_map = map.keyframes();
  record.not_joined = map.not_joined();
  if (const std::string damage = map.damage(); !damage.empty()) warn(damage);
  record.final = corrected(map, run);
  if (!arguments.final_ba) return;
  timer.lap_ms();
  record.adjustment = map.adjust();
  record.adjust_ms = timer.lap_ms();
  record.adjusted = corrected(map, run);
}

Result<void> save_map(const MapArguments& arguments, const LoopMap& map) {
  return arguments.save.empty() ? Result<void>{} : map.save(arguments.save);
}

Result<void> write_map_record(const MapRecord& record, const std::string& folder) {
  if (Result<void> done = write_tum(record.adjusted.empty() ? record.final : record.adjusted, folder + "/map_trajectory_tum.txt");
      !done)
    return done;
  if (Result<void> done = write_tum(record.causal, folder + "/map_causal_tum.txt"); !done) return done;
  if (Result<void> done = write_tum(record.bounded, folder + "/map_bounded_tum.txt"); !done) return done;
  std::string text = kUpdatesHeader;
  for (const MapUpdate& u : record.updates) text += row_of(u);
  return write_file_atomically(folder + "/map_updates.csv", text);
}

MapSummary summarise(const MapRecord& record, const RunRecord& run, const Trajectory<W>& truth) {
  MapSummary s;
  for (const MapUpdate& u : record.updates) {
    s.loops += u.stats.accepted;
    s.refused += u.stats.refused;
    s.anchors += u.stats.anchors;
    s.anchors_refused += u.stats.anchors_refused;
    s.mean_ms += u.stats.total_ms() / static_cast<double>(record.updates.size());
  }
  s.keyframes = static_cast<int>(record.updates.size());
  s.keyframes_in_map = record.keyframes_in_map;
  s.left_out = record.graph.rejected;
  s.anchors_left_out = record.graph.anchors_rejected;
  const Trajectory<W> poses = run.poses();
  const auto anchored = std::ranges::find_if(record.updates, [](const MapUpdate& u) { return u.anchored && u.localised; });
  if (anchored != record.updates.end() && !poses.empty()) s.anchored_after_s = (anchored->t - poses.front().t).seconds();
  if (!record.causal.empty()) s.localised_after_s = (record.causal.front().t - poses.front().t).seconds();
  s.found_again = found_again(record, run);
  s.not_joined = record.not_joined;
  s.causal = evaluated(truth, record.causal);
  s.bounded = evaluated(truth, record.bounded);
  s.final = evaluated(truth, record.final);
  s.adjusted = evaluated(truth, record.adjusted);
  s.finish_ms = record.finish_ms;
  s.adjust_ms = record.adjust_ms;
  s.adjustment = record.adjustment;
  return s;
}

}  // namespace fbvins::app
