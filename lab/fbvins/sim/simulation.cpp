// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/io/imu_file.hpp"
#include "fbvins/io/kalibr.hpp"
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

/// Adds cameras like these of the rig, turned about the vertical of an upright rig, which is the left camera's -y, through a
/// point 5 cm behind it.
void add_turned(StereoRig& rig, double degrees, std::initializer_list<int> cameras) {
  std::vector<MountedCamera> all;
  for (int i = 0; i < rig.camera_count(); ++i) all.push_back(rig.mounted(i));
  const Vec3 axis = -(rig.T_BC0.q * Vec3::UnitY()), through = rig.T_BC0 * Vec3(0, 0, -0.05);
  const Quat turn(Eigen::AngleAxisd(degrees * kDegree, axis));
  const Pose<B, B> turned(turn, Vec3(through - turn * through));
  for (const int i : cameras) all.push_back({rig.camera(i), turned * rig.T_BC(i)});
  rig = with_cameras(rig, all);
}

/// 200 degrees across a circle of 800 pixels, outside of which the image is black.
Camera fisheye() {
  constexpr double kRadius_px = 400;
  const Vec2 centre(423.5, 399.5);
  Image seen(848, 800, 0);
  for (int y = 0; y < seen.height(); ++y)
    for (int x = 0; x < seen.width(); ++x)
      if ((Vec2(x, y) - centre).norm() <= kRadius_px) seen.at(x, y) = 255;
  Camera camera(KannalaBrandt{229, 229, centre.x(), centre.y(), 0, 0, 0, 0}, seen.width(), seen.height());
  camera.set_mask(std::make_shared<const Mask>(seen));
  return camera;
}

/// As far to the right of the left camera, and slightly turned.
MountedCamera depth_camera(const Pose<B, C0>& T_BC0, double apart_m) {
  const Pose<C0, C0> T_CD(so3_exp(Vec3(0.012, -0.02, 0.008)), Vec3(apart_m, 0, 0));
  return {Camera(PinholeRadtan{382, 382, 318.4, 241.7, 0, 0, 0, 0}, 640, 480), T_BC0 * T_CD};
}

void put_lens(StereoRig& rig, const Camera& camera) {
  rig.left = camera;
  if (rig.has_right()) rig.right = camera;
}

/// Renders frames for a Dataset.
class RenderingLoader : public FrameLoader {
 public:
  RenderingLoader(Simulation simulation, Duration offset) : simulation_(std::move(simulation)), offset_(offset) {}

  LoadedFrame load(const FrameEntry& entry) override {
    const auto at = std::lower_bound(simulation_.frames.begin(), simulation_.frames.end(), entry.t + offset_);
    LoadedFrame loaded;
    loaded.frame = render_frame(simulation_, static_cast<std::size_t>(at - simulation_.frames.begin())).frame;
    return loaded;
  }

 private:
  Simulation simulation_;
  Duration offset_;
};

}  // namespace

Result<StereoRig> simulated_rig(const SimulationOptions& o) {
  StereoRig rig = euroc_rig();
  if (!o.calibration.empty()) {
    Result<StereoRig> loaded = load_kalibr(o.calibration);
    if (!loaded) return loaded.error();
    rig = *loaded;
  }
  if (o.rig == "mono") rig = with_one_camera(rig);
  if (o.rig == "fisheye") put_lens(rig, fisheye());
  if (o.rig == "back-to-back") {
    rig = with_one_camera(rig);
    put_lens(rig, fisheye());
    add_turned(rig, 180, {0});
  }
  if (o.rig == "quad") add_turned(rig, 180, {0, 1});
  if (o.rig == "sides") add_turned(rig, 90, {0}), add_turned(rig, -90, {0});
  if (o.rig == "rgbd") {
    rig = with_depth(rig,
                     {.noise_at_1m_m = o.depth.noise_at_1m_m, .nearest_m = o.depth.nearest_m, .farthest_m = o.depth.farthest_m});
    if (o.depth.apart_m > 0) rig.depth->own = depth_camera(rig.T_BC0, o.depth.apart_m);
  }
  for (int i = 1; o.camera.later_ms > 0 && i < rig.camera_count(); ++i) {
    Camera& camera = i == 1 ? rig.right : rig.more[static_cast<std::size_t>(i - 2)].camera;
    camera.set_own_times({.time_offset_s = 1e-3 * i * o.camera.later_ms});
  }
  rig.image_rate_hz = o.image_rate_hz;
  rig.time_offset_s = o.camera.time_offset_ms * 1e-3;
  rig.line_delay_s = o.camera.line_delay_us * 1e-6;
  return rig;
}

FrameTimes::FrameTimes(const SimulationOptions& options)
    : rate_hz_(options.image_rate_hz),
      drop_share_(options.camera.drop_share),
      rng_(static_cast<std::uint64_t>(options.seed), 61) {
  advance();
}

void FrameTimes::advance() {
  do ++k_;
  while (rng_.uniform() < drop_share_);
}

RenderedFrame render_at(FlightRecorder& recorder, const StereoRig& rig, double t_s, std::int64_t frame, bool with_depth,
                        Time start) {
  RenderedFrame rendered = recorder.render(t_s, frame, with_depth);
  rendered.frame.t = start + Duration::from_seconds(t_s) - Duration::from_seconds(rig.time_offset_s);
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
  Result<StereoRig> rig = simulated_rig(o);
  if (!rig) return rig.error();

  Simulation s;
  s.rig = *rig;
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
  contents.rig = simulation.rig;
  contents.imu = simulation.imu.samples;
  for (const TrueState& s : simulation.imu.truth) contents.ground_truth.push_back({s.t, s.T_WB, s.v_WB, s.bias});
  const StereoRig& rig = simulation.rig;
  for (Time t : simulation.frames)
    contents.frames.push_back({t - offset, "left", rig.has_right() ? "right" : "", std::nullopt,
                               std::vector<std::string>(rig.more.size(), "more"), rig.depth ? "depth" : ""});
  DatasetInfo& info = contents.info;
  info.name = name;
  info.format = "simulation";
  info.frames = info.left.listed = static_cast<int>(contents.frames.size());
  if (rig.has_right()) info.right.listed = info.frames;
  if (rig.depth) info.depth.listed = info.frames;
  info.imu_samples = static_cast<int>(contents.imu.size());
  info.ground_truth_poses = static_cast<int>(contents.ground_truth.size());
  info.image_rate_hz = simulation.rig.image_rate_hz;
  info.imu_rate_hz = simulation.rig.imu_noise.rate_hz;
  if (!contents.frames.empty()) info.first_image = contents.frames.front().t, info.last_image = contents.frames.back().t;
  if (!contents.imu.empty()) info.first_imu = contents.imu.front().t, info.last_imu = contents.imu.back().t;
  contents.loader = std::make_unique<RenderingLoader>(std::move(simulation), offset);
  return contents;
}

Result<DatasetContents> simulate(const SimulationOptions& options, const std::string& name) {
  Result<Simulation> simulation = prepare_simulation(options);
  if (!simulation) return simulation.error();
  return contents_of(*std::move(simulation), name);
}

}  // namespace fbvins
