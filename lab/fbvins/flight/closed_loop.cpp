// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/closed_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/options.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/flight/board_imu.hpp"
#include "fbvins/flight/companion_controller.hpp"
#include "fbvins/flight/live_link.hpp"
#include "fbvins/flight/motion_history.hpp"
#include "fbvins/sim/sensor_station.hpp"

namespace fbvins {
namespace {

/// The IMU is in front of and above the centre of mass.
const Vec3 kImuOnVehicle_m(0.04, 0, 0.03);
constexpr int kCollisionEvery_steps = 10;
constexpr double kAfterwards_s = 1.0;  ///< recorded after the last step or after touchdown
constexpr double kHardLanding_mps = 1.5, kTippedOver = 0.8;

/// The true mounting: the nominal one with a random assembly error.
Pose<BodyFlu, B> with_mounting_error(const Pose<BodyFlu, B>& mounting, const FlightSetup& setup) {
  Rng rng(static_cast<std::uint64_t>(setup.simulation.seed), 73);
  const double sigma = setup.mounting_error_deg * std::numbers::pi / 180, x = rng.normal(), y = rng.normal(), z = rng.normal();
  return {(so3_exp(sigma * Vec3(x, y, z)) * mounting.q).normalized(), mounting.p};
}

double hover_radps(const QuadrotorOptions& o) {
  return std::sqrt(o.mass_kg * kSimGravity_mps2 / (kRotors * o.thrust_N_per_radps2));
}

/// Through rotation matrices, as calibration files have them: they change the last bits of a quaternion. With the same bits a
/// replay of the recording gives the same bytes.
StereoRig as_recorded(StereoRig rig) {
  for (MountedCamera& mounted : rig.cameras) mounted.T_BC = Pose<B, C0>(mounted.T_BC.R(), mounted.T_BC.p);
  return rig;
}

Result<std::unique_ptr<FlightController>> controller_of(const FlightSetup& setup, const StereoRig& rig) {
  const Pose<BodyFlu, B> mounting = imu_mounting(rig, setup.simulation.flight.camera_pitch_deg);
  if (setup.controller.kind == ControllerProgram::Kind::own)
    return std::unique_ptr<FlightController>(std::make_unique<Autopilot>(setup.mission, setup.control, rig, mounting));
  return start_controller(setup.controller, setup.mission, setup.control, setup.vehicle, rig, mounting);
}

Result<std::unique_ptr<OdometryLink>> link_of(const FlightSetup& setup, const StereoRig& rig) {
  if (setup.wall_rate > 0) return LiveLink::create(setup.estimator, setup.live, rig, setup.wall_rate);
  return EstimatorLink::create(setup.estimator, rig);
}

class ClosedLoop {
 public:
  ClosedLoop(const FlightSetup& setup, const MissionSite& site, SensorStation station, std::unique_ptr<OdometryLink> link,
             std::unique_ptr<FlightController> controller)
      : setup_(setup),
        station_(std::move(station)),
        link_(std::move(link)),
        mounting_(with_mounting_error(imu_mounting(station_.rig(), setup.simulation.flight.camera_pitch_deg), setup)),
        vehicle_(setup.vehicle, standing_at(site.origin_W.head<2>(), site.heading_rad, setup.vehicle)),
        start_(vehicle_.state().T_WV),
        wind_(setup.wind, static_cast<std::uint64_t>(setup.simulation.seed)),
        barometer_(setup.barometer, static_cast<std::uint64_t>(setup.simulation.seed)),
        collisions_(station_.world(), hull_of(setup.vehicle)),
        controller_(std::move(controller)),
        steps_per_reading_(steps_at(station_.rig().imu_noise.rate_hz)) {
    if (controller_->board_rate_hz() > 0)
      board_.emplace(controller_->board_rate_hz(), setup.simulation.imu, static_cast<std::uint64_t>(setup.simulation.seed));
  }

  Result<FlightLog> run(const std::function<void(double, FlightMode)>& progress) {
    if (!setup_.recording.empty()) {
      Result<EurocFolder> folder = create_simulated_recording(setup_.recording, station_.rig());
      if (!folder) return folder.error();
      recording_.emplace(std::move(*folder));
    }
    if (Result<void> done = warm_up(); !done) return done.error();
    const auto last = static_cast<std::int64_t>(longest_flight_s(setup_.mission) / Quadrotor::kStep_s);
    for (step_ = 0; !over_ && step_ < last; ++step_) {
      history_.add(now_s(), vehicle_.motion_of(mounting_));
      if (Result<void> done = render_due_images(); !done) return done.error();
      if (board_ && step_ % steps_at(controller_->board_rate_hz()) == 0)
        if (Result<void> done = feel_board(now_s()); !done) return done.error();
      if (step_ % steps_per_reading_ == 0) {
        if (Result<void> done = read_imu(); !done) return done.error();
        if (progress) progress(now_s(), controller_->output().mode);
      }
      vehicle_.step(controller_->commands(), wind_.step(Quadrotor::kStep_s, vehicle_.state().T_WV.p.z()));
      watch();
    }
    log_.start = start_;
    log_.out_of_time = !over_;
    if (Result<void> done = link_->finish(); !done) return done.error();
    if (recording_)
      if (Result<void> done = finish_recording(*recording_, log_.imu); !done) return done.error();
    log_.mode = controller_->output().mode;
    log_.reason = controller_->output().reason;
    log_.events = controller_->events();
    log_.controller_resets = controller_->resets_in_flight();
    log_.wall_time = link_->wall_time();
    return std::move(log_);
  }

 private:
  static VehicleHull hull_of(const QuadrotorOptions& o) {
    return {.radius_m = std::hypot(o.arm_x_m, o.arm_y_m) + o.rotor_radius_m, .half_height_m = 0.12};
  }
  double now_s() const { return static_cast<double>(step_) * Quadrotor::kStep_s; }
  bool failed(MissionFault::What what) const {
    if (!airborne_s_) return false;
    const double t = now_s() - *airborne_s_;
    return std::any_of(setup_.mission.faults.begin(), setup_.mission.faults.end(), [&](const MissionFault& f) {
      return f.what == what && t >= f.at_s && (f.for_s == 0 || t < f.at_s + f.for_s);
    });
  }

  static int steps_at(double rate_hz) { return std::max(1, static_cast<int>(std::lround(1 / (Quadrotor::kStep_s * rate_hz)))); }
  PerRotor rotor_shares() const {
    PerRotor shares = vehicle_.state().rotor_radps;
    for (double& w : shares) w /= hover_radps(setup_.vehicle);
    return shares;
  }

  /// A flight controller with its own sensors is switched on before the flight begins.
  Result<void> warm_up() {
    if (!board_) return {};
    const double rate_hz = controller_->board_rate_hz();
    next_barometer_s_ = -controller_->warm_up_s();
    for (auto n = static_cast<std::int64_t>(next_barometer_s_ * rate_hz); n < 0; ++n)
      if (Result<void> done = feel_board(static_cast<double>(n) / rate_hz); !done) return done;
    return {};
  }
  Result<void> feel_board(double t_s) {
    read_barometer(t_s);
    return controller_->take_board(board_->read(t_s, vehicle_, rotor_shares()));
  }
  void read_barometer(double t_s) {
    if (t_s < next_barometer_s_) return;
    controller_->add_barometer(barometer_.read(vehicle_.state().T_WV.p.z()));
    next_barometer_s_ += 1 / Barometer::kRate_hz;
  }

  /// Renders the images whose exposure has ended.
  Result<void> render_due_images() {
    while (now_s() > station_.next_image_s() + 0.5 * station_.longest_exposure_s()) {
      const RenderedFrame rendered = station_.render([this](double t) { return history_.at(t); });
      ++log_.images;
      const StereoFrame& frame = rendered.frame;
      if (recording_)
        if (Result<void> done = recording_->add(frame, rendered.right_stamp); !done) return done;
      if (failed(MissionFault::What::cameras)) continue;
      if (Result<void> done = link_->push(frame); !done) return done;
    }
    return {};
  }

  /// One IMU reading: odometry, control and log.
  Result<void> read_imu() {
    const ImuSample reading = station_.read_imu(vehicle_.motion_of(mounting_), rotor_shares());
    log_.imu.samples.push_back(reading);
    log_.imu.truth.push_back(station_.truth());
    if (Result<void> done = link_->push(reading); !done) return done;
    const Duration delay = Duration::from_seconds(setup_.estimate_delay_s + station_.rig().time_offset_s);
    Result<std::vector<KnownEstimate>> known = link_->known_at(reading.t - delay);
    if (!known) return known.error();
    for (const KnownEstimate& estimate : *known) {
      log_.odometry.push_back(estimate.odometry);
      if (failed(MissionFault::What::odometry)) continue;
      controller_->add(estimate.odometry);
      for (const MapUpdate& update : estimate.updates) controller_->add(update);
    }
    read_barometer(now_s());
    if (Result<void> done = controller_->take(reading); !done) return done;
    if (!airborne_s_ && controller_->output().mode == FlightMode::mission) airborne_s_ = now_s();
    write_row();
    return {};
  }

  void write_row() {
    const QuadrotorState& s = vehicle_.state();
    const Pose<BodyFlu, W> T_LW = start_.inverse();
    FlightRow row;
    row.t_s = now_s();
    row.truth = (T_LW * s.T_WV).cast_frames<Local, BodyFlu>();
    row.true_velocity = T_LW.q * s.v_WV;
    row.autopilot = controller_->output();
    row.autopilot.control.commands = controller_->commands();
    row.rotor_radps = s.rotor_radps;
    row.battery_V = vehicle_.battery_V();
    log_.rows.push_back(row);
  }

  /// Ends the flight when the mission is done or the vehicle crashes.
  void watch() {
    const AutopilotOutput& out = controller_->output();
    const QuadrotorState& s = vehicle_.state();
    const bool done = out.mode == FlightMode::landed || (airborne_s_ && out.step >= setup_.mission.steps.size());
    afterwards_s_ = done ? afterwards_s_ + Quadrotor::kStep_s : 0;
    over_ = afterwards_s_ > kAfterwards_s;
    if (!airborne_s_ || step_ % kCollisionEvery_steps != 0) return;
    if (const std::optional<Vec3> place = collisions_.touched_at(s.T_WV.p))
      crash(fmt::format("touched something at ({:.2f}, {:.2f}, {:.2f}) of the world", place->x(), place->y(), place->z()));
    const double up = (s.T_WV.q * Vec3::UnitZ()).z();
    if (vehicle_.on_ground() && up < kTippedOver) crash("tipped over on the floor");
    if (vehicle_.on_ground() && !was_on_ground_ && falling_mps_ > kHardLanding_mps)
      crash(fmt::format("met the floor at {:.1f} m/s", falling_mps_));
    was_on_ground_ = vehicle_.on_ground();
    falling_mps_ = -s.v_WV.z();
  }
  void crash(const std::string& what) {
    if (log_.crash) return;
    log_.crash = fmt::format("{} after {:.2f} s", what, now_s());
    over_ = true;
  }

  const FlightSetup& setup_;
  SensorStation station_;
  std::unique_ptr<OdometryLink> link_;
  Pose<BodyFlu, B> mounting_;
  Quadrotor vehicle_;
  Pose<W, BodyFlu> start_;
  Wind wind_;
  Barometer barometer_;
  CollisionCheck collisions_;
  std::unique_ptr<FlightController> controller_;
  std::optional<BoardImu> board_;
  int steps_per_reading_;
  MotionHistory history_;
  std::optional<EurocFolder> recording_;
  FlightLog log_;
  std::int64_t step_ = 0;
  std::optional<double> airborne_s_;  ///< when the mission began
  double next_barometer_s_ = 0, afterwards_s_ = 0, falling_mps_ = 0;
  bool was_on_ground_ = true, over_ = false;
};

}  // namespace

ControlOptions control_for(const QuadrotorOptions& vehicle) {
  ControlOptions control;
  const double full_N = kRotors * vehicle.thrust_N_per_radps2 * vehicle.rotor_max_radps * vehicle.rotor_max_radps;
  control.position.MPC_THR_HOVER = vehicle.mass_kg * kSimGravity_mps2 / full_N;
  control.THR_MDL_FAC = vehicle.command_is_thrust ? 0 : 1;
  // Tuned for holding a place indoors: stiffer than PX4's defaults, which are for the wind and GPS of outdoors.
  control.position.MPC_XY_P = control.position.MPC_Z_P = 1.5;
  control.position.MPC_XY_VEL_P_ACC = 3.0;
  control.position.MPC_XY_VEL_I_ACC = 1.5;
  return control;
}

Pose<BodyFlu, B> imu_mounting(const StereoRig& rig, double camera_pitch_deg) {
  return {body_in_vehicle(rig, camera_pitch_deg), kImuOnVehicle_m};
}

Result<FlightLog> fly(const FlightSetup& setup, const std::function<void(double, FlightMode)>& progress) {
  for (const Result<void>& valid :
       {validate(setup.vehicle), validate(setup.control), validate(setup.wind), validate(setup.barometer)})
    if (!valid) return valid.error();
  const SimulationOptions& o = setup.simulation;
  const PlaceDefaults defaults{o.world.kind, o.world.margin_m, o.world.height_m, o.flight.extent_x_m, o.flight.extent_y_m};
  const double standing_m = standing_at({0, 0}, 0, setup.vehicle).T_WV.p.z();
  const Result<MissionSite> site = site_of(setup.mission, defaults, standing_m);
  if (!site) return site.error();
  std::vector<Vec3> path;
  for (const MissionPoint& place : path_points(setup.mission)) path.push_back(site->to_world(place.p));
  SimulationOptions options = o;
  options.world.kind = setup.mission.place.kind.empty() ? o.world.kind : setup.mission.place.kind;
  Result<SensorStation> station = SensorStation::create(options, site->plan, path);
  if (!station) return station.error();
  Result<std::unique_ptr<OdometryLink>> link = link_of(setup, as_recorded(station->rig()));
  if (!link) return link.error();
  Result<std::unique_ptr<FlightController>> controller = controller_of(setup, station->rig());
  if (!controller) return controller.error();
  return ClosedLoop(setup, *site, *std::move(station), *std::move(link), *std::move(controller)).run(progress);
}

}  // namespace fbvins
