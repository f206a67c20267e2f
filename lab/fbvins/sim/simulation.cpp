// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/core/options.hpp"
#include "fbvins/io/imu_file.hpp"
#include "fbvins/sim/recorded_flight.hpp"
#include "fbvins/sim/simulation_parts.hpp"

namespace fbvins {
namespace {

Result<RecordedFlight> recorded_flight(const RecordedOptions& o, double duration_s) {
  Result<TrajectoryFile> file = read_trajectory(o.trajectory);
  if (!file) return file.error();
  std::vector<TrajectoryPoint>& points = file->points;
  if (points.empty()) return Error{ErrorCode::malformed, fmt::format("{}: contains no pose", o.trajectory)};
  const Time from = points.front().t + Duration::from_seconds(o.start_s), to = from + Duration::from_seconds(duration_s);
  std::erase_if(points, [&](const TrajectoryPoint& p) { return p.t < from || p.t > to; });
  if (o.imu.empty()) return fly_again(points, o.crossover_hz);
  Result<std::vector<ImuSample>> imu = read_imu_csv(o.imu);
  if (!imu) return imu.error();
  return fly_again(points, *imu, o.crossover_hz);
}

/// Stamps of the images on the IMU's clock.
std::vector<Time> frame_times(const SimulationOptions& o, Time start, double duration_s) {
  std::vector<Time> times;
  for (FrameTimes frames(o); frames.next_s() <= duration_s - kMargin_s; frames.advance())
    times.push_back(start + Duration::from_seconds(frames.next_s()));
  return times;
}

FloorPlan plan_for(const SimulationOptions& o, const std::vector<Vec3>& path) {
  if (o.world.kind == "corridors")
    return corridor_ring(o.flight.extent_x_m, o.flight.extent_y_m, std::max(o.world.height_m, 2.6));
  return room_around(path, o.world.margin_m, o.world.height_m);
}

std::vector<Vec3> path_of(const SplineTrajectory& flight) {
  std::vector<Vec3> path;
  for (double t = 0; t < flight.duration_s(); t += 0.1) path.push_back(flight.pose(t).p);
  return path;
}

/// For a flight that follows real readings, and shakes as they did.
ImuModelOptions without_vibration(ImuModelOptions options) {
  options.vibration_accel_mps2 = options.vibration_gyro_radps = 0;
  options.rumble_accel_mps2_rthz = options.rumble_gyro_radps_rthz = 0;
  return options;
}

/// Renders frames for a Dataset.
class RenderingLoader : public FrameLoader {
 public:
  RenderingLoader(Simulation simulation, std::vector<Time> stamps)
      : simulation_(std::move(simulation)), stamps_(std::move(stamps)) {}

  LoadedFrame load(const FrameEntry& entry) override {
    const auto at = std::ranges::lower_bound(stamps_, entry.t);
    LoadedFrame loaded;
    loaded.frame = render_frame(simulation_, static_cast<std::size_t>(at - stamps_.begin())).frame;
    return loaded;
  }

 private:
  Simulation simulation_;
  std::vector<Time> stamps_;  ///< of the images
};

std::vector<AidingSample> simulate_aiding(const SimulationOptions& o, const Simulation& s) {
  const auto seed = static_cast<std::uint64_t>(o.seed);
  const Mat3 R_BV = body_in_vehicle(s.rig, o.flight.camera_pitch_deg).conjugate().toRotationMatrix();
  std::vector<AidingSample> out;
  for (const auto& r : simulate_ranges(s.flight, *s.world, s.world_from_flight, R_BV, o.range, s.start, seed))
    out.emplace_back(r);
  for (const auto& r : simulate_velocities(s.flight, R_BV, o.velocity, s.start, seed)) out.emplace_back(r);
  for (const auto& r : simulate_pressures(s.flight, o.barometer, s.start, seed)) out.emplace_back(r);
  std::ranges::stable_sort(out, {}, [](const AidingSample& r) { return stamp_of(r); });
  return out;
}

}  // namespace

RenderedFrame render_at(FlightRecorder& recorder, const StereoRig& rig, double t_s, std::int64_t frame, bool with_depth,
                        Time start) {
  RenderedFrame rendered = recorder.render(t_s, frame, with_depth);
  rendered.frame.t =
      start + Duration::from_seconds(t_s) - Duration::from_seconds(rig.time_offset_s) + recorder.stamp_error(frame);
  rendered.right_stamp = rendered.frame.t + rendered.frame.offsets.of(1) + recorder.right_jitter(frame);
  return rendered;
}

Result<Simulation> prepare_simulation(const SimulationOptions& o, const std::function<void(World&, const Simulation&)>& change) {
  if (Result<void> valid = validate(o); !valid) return valid.error();
  const bool is_recorded = !o.recorded.trajectory.empty();
  if (o.world.kind == "corridors" && (is_recorded || o.flight.kind != "tour"))
    return Error{ErrorCode::invalid_argument,
                 "world.kind=corridors needs flight.kind=tour: other flights would pass through walls"};
  if (!is_recorded && !o.recorded.imu.empty())
    return Error{ErrorCode::invalid_argument, "recorded.imu is given without recorded.trajectory"};
  if (o.sensors != "none" && !is_recorded && !o.calibration.empty())
    return Error{ErrorCode::invalid_argument, "calibration and sensors both say what the cameras are: give one of them"};
  Result<StereoRig> rig = simulated_rig(o);
  if (!rig) return rig.error();
  if (auto intervals = image_intervals_s(o); !intervals) return intervals.error();

  Simulation s;
  s.rig = *rig;
  s.calibrated = calibrated_rig(o, *rig);
  s.start = kSimulationStart;
  const auto seed = static_cast<std::uint64_t>(o.seed);
  if (is_recorded) {
    Result<RecordedFlight> recorded = recorded_flight(o.recorded, o.flight.duration_s);
    if (!recorded) return recorded.error();
    s.flight = std::move(recorded->flight);
    s.start = recorded->start;
    s.imu = std::move(recorded->imu);
  } else {
    const FloorPlan plan = plan_for(o, {Vec3::Zero()});
    s.flight = make_flight(o.flight, body_in_vehicle(s.rig, o.flight.camera_pitch_deg), plan.tour, seed);
  }
  if (s.imu.samples.empty()) s.imu = simulate_imu(s.flight, s.rig.imu_noise, o.imu, s.start, seed);
  else if (o.sensors != "none") s.imu = simulate_imu(s.flight, s.rig.imu_noise, without_vibration(o.imu), s.start, seed);
  s.frames = frame_times(o, s.start, s.flight.duration_s());

  // The floor is at z = 0; a recorded flight's origin may be anywhere.
  std::vector<Vec3> path = path_of(s.flight);
  if (is_recorded) {
    double lowest = path.front().z();
    for (const Vec3& p : path) lowest = std::min(lowest, p.z());
    s.world_from_flight = Vec3(0, 0, 0.5 - lowest);
    for (Vec3& p : path) p += s.world_from_flight;
  }
  World world = build_world(o.world, plan_for(o, path), path, seed);
  if (change) change(world, s);
  s.world = std::make_shared<const World>(std::move(world));
  s.aiding = simulate_aiding(o, s);
  s.recorder = std::make_shared<FlightRecorder>(
      o, s.rig, [flight = s.flight](double t) { return flight.at(t); }, s.world_from_flight, s.world);
  return s;
}

RenderedFrame render_frame(Simulation& simulation, std::size_t index, bool with_depth) {
  const double t_s = (simulation.frames[index] - simulation.start).seconds();
  return render_at(*simulation.recorder, simulation.rig, t_s, static_cast<std::int64_t>(index), with_depth, simulation.start);
}

DatasetContents contents_of(Simulation simulation, const std::string& name) {
  DatasetContents contents;
  const Duration offset = Duration::from_seconds(simulation.rig.time_offset_s);
  contents.rig = simulation.calibrated;
  contents.imu = simulation.imu.samples;
  contents.aiding = simulation.aiding;
  for (const TrueState& s : simulation.imu.truth) contents.ground_truth.push_back({s.t, s.T_WB, s.v_WB, s.bias});
  const StereoRig& rig = simulation.rig;
  std::vector<Time> stamps;
  for (std::size_t i = 0; i < simulation.frames.size(); ++i)
    stamps.push_back(simulation.frames[i] - offset + simulation.recorder->stamp_error(static_cast<std::int64_t>(i)));
  for (Time t : stamps)
    contents.frames.push_back(
        {.t = t, .files = std::vector<std::string>(rig.cameras.size(), "rendered"), .depth_file = rig.depth ? "depth" : ""});
  DatasetInfo& info = contents.info;
  info.name = name;
  info.format = "simulation";
  info.frames = static_cast<int>(contents.frames.size());
  for (int i = 0; i < std::min(2, rig.camera_count()); ++i) info.camera(i).listed = info.frames;
  if (rig.depth) info.depth.listed = info.frames;
  info.imu_samples = static_cast<int>(contents.imu.size());
  info.ground_truth_poses = static_cast<int>(contents.ground_truth.size());
  info.image_rate_hz = simulation.rig.image_rate_hz;
  info.imu_rate_hz = simulation.rig.imu_noise.rate_hz;
  if (!contents.frames.empty()) info.first_image = contents.frames.front().t, info.last_image = contents.frames.back().t;
  if (!contents.imu.empty()) info.first_imu = contents.imu.front().t, info.last_imu = contents.imu.back().t;
  contents.loader = std::make_unique<RenderingLoader>(std::move(simulation), std::move(stamps));
  return contents;
}

Result<DatasetContents> simulate(const SimulationOptions& options, const std::string& name) {
  Result<Simulation> simulation = prepare_simulation(options);
  if (!simulation) return simulation.error();
  return contents_of(*std::move(simulation), name);
}

}  // namespace fbvins
