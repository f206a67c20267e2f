// SPDX-License-Identifier: Apache-2.0
#include "apps/run_flight.hpp"

#include <chrono>

#include "apps/imu_state.hpp"
#include "fbvins/checkup/first_seconds.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins::app {
namespace {

/// As the last frame in good health knew the IMU.
Result<void> keep_imu_state(const std::string& path, const RunRecord& run, const StereoRig& rig) {
  std::optional<ImuState> state;
  for (auto o = run.odometry.rbegin(); o != run.odometry.rend() && !state; ++o) state = imu_state_of(*o, rig.time_offset_s);
  return save_imu_state(path, state, rig.imu_noise);
}

/// Sends the anchors that are not later than the next image.
class AnchorFeed {
 public:
  explicit AnchorFeed(std::vector<Anchor> anchors) : anchors_(std::move(anchors)) {}
  Result<void> send_until(Time t, System& system) {
    for (; next_ < anchors_.size() && stamp_of(anchors_[next_]) <= t; ++next_)
      if (Result<void> taken = system.push(anchors_[next_]); !taken) return taken;
    return {};
  }

 private:
  std::vector<Anchor> anchors_;
  std::size_t next_ = 0;
};

Result<Flight> process(const FlightArguments& arguments, const Config& config, Dataset& data, LoopMap* map,
                       const FlightListener& listener) {
  const auto imu_state = load_imu_state(arguments.imu_state, data.rig().imu_noise);
  if (!imu_state) return imu_state.error();
  auto positions = positions_of(arguments.map);
  if (!positions) return positions.error();
  AnchorFeed anchors(*std::move(positions));
  std::unique_ptr<Mapper> with_tags;
  const Result<Mapper*> mapper = mapper_of(arguments.map, data.rig(), map, with_tags);
  if (!mapper) return mapper.error();
  Flight flight;
  if (map != nullptr) flight.map.emplace();
  flight.run.tracked.reserve(data.frames().size());
  flight.run.odometry.reserve(data.frames().size());
  Result<System> system = System::create(config, data.rig(), arguments.threaded ? RunMode::threaded : RunMode::deterministic,
                                         {.mapper = *mapper, .imu_state = *imu_state});
  if (!system) return system.error();
  SurvivalMeter survival;
  system->on_tracked_frame([&](const TrackedFrame& f) { flight.run.tracked.push_back({f.id, f.t, f.stats, survival.add(f)}); });
  system->on_odometry([&](const Odometry& o) { flight.run.odometry.push_back(o); });
  system->on_map_update([&](MapUpdate u) { flight.map->updates.push_back((u.corrected.clear(), std::move(u))); });
  const DatasetInfo& info = data.info();
  std::optional<StampEnds> ends;
  if (info.imu_samples > 0) ends = {info.first_image, info.last_image, info.first_imu, info.last_imu};
  FirstSeconds look(data.rig(), ends);
  bool looking = listener.on_finding != nullptr;
  const auto end_look = [&] {
    looking = false;
    for (const Finding& finding : look.findings()) listener.on_finding(finding);
  };
  int frames = 0;
  while (auto event = data.next()) {
    if (looking) look.push(*event);
    if (looking && look.is_over()) end_look();
    const auto* frame = std::get_if<StereoFrame>(&*event);
    const bool is_frame = frame != nullptr;
    if (is_frame)
      if (Result<void> sent = anchors.send_until(frame->t, *system); !sent) return sent.error();
    if (Result<void> taken = system->push(std::move(*event)); !taken) return taken.error();
    if (is_frame && listener.on_frame) listener.on_frame(++frames);
  }
  if (looking) end_look();
  if (Result<void> done = system->finish(); !done) return done.error();
  flight.calibration = system->calibration();
  flight.images_repeated = system->input_counts().images_repeated;
  return flight;
}

/// What the options let the flight refine.
std::optional<RefinedCalibration> refined_calibration(const Calibration& found, const StereoRig& rig, const EstimatorOptions& o) {
  RefinedCalibration out;
  if (o.estimate_time_offset || found.time_offset_s != 0) out.time_offset_s = rig.time_offset_s + found.time_offset_s;
  if (o.estimate_line_delay || found.line_delay_s != 0) out.line_delay_s = rig.line_delay_s + found.line_delay_s;
  if (o.estimate_extrinsics && !rig.depth)
    for (int i = 0; i < std::min(2, rig.camera_count()); ++i) out.T_BC.push_back(found.T_BC(i));
  if (!out.time_offset_s && !out.line_delay_s && out.T_BC.empty()) return std::nullopt;
  return out;
}

}  // namespace

Result<Flight> run_flight(const FlightArguments& arguments, const Config& config, Dataset& data, const FlightListener& listener) {
  const auto start = std::chrono::steady_clock::now();
  const auto map = make_map(arguments.map, data.rig(), config.loop);
  if (!map) return map.error();
  Result<Flight> flight = process(arguments, config, data, map->get(), listener);
  if (!flight) return flight;
  if (flight->map) {
    finish_map(arguments.map, **map, flight->run, *flight->map);
    if (Result<void> saved = save_map(arguments.map, **map); !saved) flight->map->not_saved = saved.error().message;
  }
  if (Result<void> kept = keep_imu_state(arguments.imu_state, flight->run, data.rig()); !kept) return kept.error();
  flight->wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return flight;
}

RunSummary summarise(const Flight& flight, const Dataset& data, const Config& config, const FlightArguments& arguments) {
  RunSummary summary = summarise(flight.run, data);
  if (flight.map) summary.map = summarise(*flight.map, flight.run, truth_of(data, time_offset_found_s(flight.run)));
  if (summary.map) summary.map->loaded = arguments.map.load;
  summary.frontend = config.frontend.kind;
  if (summary.frontend == "boost") summary.booster_weights = booster_weights_path(config.frontend.boost.booster.weights);
  summary.mode = arguments.threaded ? "threaded" : "deterministic";
  summary.wall_s = flight.wall_s;
  summary.refined = refined_calibration(flight.calibration, data.rig(), config.estimator);
  return summary;
}

Result<void> write_flight(const Flight& flight, const RunSummary& summary, const Config& config,
                          const std::vector<TrajectoryPoint>& truth, const std::string& folder) {
  if (Result<void> made = make_folders(folder); !made) return made;
  if (Result<void> done = write_run(flight.run, folder); !done) return done;
  if (flight.map)
    if (Result<void> done = write_map_record(*flight.map, folder); !done) return done;
  if (Result<void> done = write_summary(summary, config, folder); !done) return done;
  return truth.empty() ? Result<void>{} : write_truth(flight.run.images(), truth, folder);
}

}  // namespace fbvins::app
