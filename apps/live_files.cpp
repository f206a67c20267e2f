// SPDX-License-Identifier: Apache-2.0
#include "apps/live_files.hpp"

#include <utility>

namespace fbvins::app {

Result<std::unique_ptr<LiveFiles>> LiveFiles::create(const std::string& folder, bool with_map, bool new_map) {
  auto run = RunWriter::create(folder);
  if (!run) return run.error();
  auto live = TumWriter::create(folder + "/live_tum.txt");
  if (!live) return live.error();
  std::unique_ptr<LiveFiles> files(new LiveFiles(std::move(*run), std::move(*live)));
  if (!with_map) return files;
  auto causal = TumWriter::create(folder + "/map_causal_tum.txt");
  if (!causal) return causal.error();
  auto bounded = TumWriter::create(folder + "/map_bounded_tum.txt");
  if (!bounded) return bounded.error();
  files->map_.emplace(MapFiles{std::move(*causal), std::move(*bounded), std::nullopt, std::nullopt});
  files->new_map_ = new_map;
  return files;
}

Result<void> LiveFiles::take(const LiveEvent& event) {
  if (const auto* odometry = std::get_if<Odometry>(&event)) {
    run_.add(*odometry);
    if (map_) take_map(*odometry);
  } else if (const auto* pose = std::get_if<LivePose>(&event)) {
    if (pose->health.has_pose()) live_.write(pose->t, pose->T_WB);
  } else if (const auto* update = std::get_if<MapUpdate>(&event)) {
    if (!map_) return {};
    map_->newest = *update;
    map_->newest->corrected.clear();
  }
  return {};
}

/// Before the first update a new map's frame equals W, while in an old map the flight has to be localised first.
void LiveFiles::take_map(const Odometry& o) {
  if (!o.health.has_pose()) return;
  const std::optional<MapUpdate>& known = map_->newest;
  if (!map_->first_reset) map_->first_reset = o.reset_counter;
  const bool localised =
      known ? known->localised && known->reset_counter == o.reset_counter : new_map_ && o.reset_counter == *map_->first_reset;
  if (!localised) return;
  map_->causal.write(o.t, known ? known->T_MG * o.gauge.T_GB : Pose<M, W>{} * o.T_WB);
  map_->bounded.write(o.t, (known ? known->T_MW_smooth : Pose<M, W>{}) * o.T_WB);
}

void LiveFiles::add(const TrackedFrame& frame) { run_.add(TrackedRecord{frame.id, frame.t, frame.stats, survival_.add(frame)}); }

Result<void> LiveFiles::finish() {
  Result<void> done = run_.close();
  if (const Result<void> live = live_.close(); done) done = live;
  if (!map_) return done;
  if (const Result<void> causal = map_->causal.close(); done) done = causal;
  if (const Result<void> bounded = map_->bounded.close(); done) done = bounded;
  return done;
}

}  // namespace fbvins::app
