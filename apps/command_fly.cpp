// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/config_arguments.hpp"
#include "apps/flight_report.hpp"
#include "apps/run_summary.hpp"
#include "apps/terminal.hpp"
#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/frontend/survival.hpp"
#include "fbvins/loop/loop_map.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(A simulated quadrotor flies the mission by the odometry's poses, which come from rendered images and a simulated IMU;
the true poses are only recorded (docs/flight.md). The same arguments give the same bytes, with --threaded or without, except
with --px4, --ardupilot and --wall-clock.
Writes the files of `fbvins run`, flight.csv, flight.json, and truth, estimate and setpoint as trajectories.

examples:
  fbvins fly configs/missions/paper.yaml                         the paper's flight
  fbvins fly configs/missions/paper.yaml --frontend orb --preset dim --seed 3
  fbvins fly configs/missions/tour.yaml --frontend orb --loop    several rooms, flown in the map frame
  fbvins fly paper.yaml --vehicle sih --control gains.yaml       another vehicle, other gains
  FBVINS_PX4=.../bin/px4 fbvins fly paper.yaml --px4             a real PX4 flies it, by our odometry
  FBVINS_ARDUPILOT=.../arducopter fbvins fly paper.yaml --ardupilot
  fbvins fly paper.yaml --wall-clock 0.5                         in wall time at half speed, through the live system of `fbvins live`
  fbvins fly --identify --out f && fbvins tune f                 gains from the vehicle's response
  fbvins fly paper.yaml --record --out f && fbvins run f/recording --frontend orb
  fbvins report f                                                path, setpoint, modes, commands in one page
)";

struct Arguments {
  std::string mission, preset = "normal", vehicle = "indoor330", out, control;
  ConfigArguments config;
  int seed = 1;
  double wind_mps = -1, wall_rate = 0;
  bool loop = false, threaded = false, record = false, quiet = false, px4 = false, ardupilot = false, identify = false;

  std::string mission_name() const { return identify ? "identify" : std::filesystem::path(mission).stem().string(); }
};

struct FlightRun {
  RunRecord run;
  FlightLog log;
};

/// Up, every axis moved in turn, and down again.
constexpr const char* kIdentify = "steps:\n  - takeoff: 1.2\n  - hold: 3\n  - identify\n  - hold: 2\n  - land\n";

Result<Mission> mission_of(const Arguments& a) {
  if (a.identify == !a.mission.empty())
    return Error{ErrorCode::invalid_argument, "either a mission to fly, or --identify for the one that moves every axis"};
  return a.identify ? parse_mission(kIdentify, a.mission_name()) : read_mission(a.mission);
}

/// The program that the environment names, if one is asked for.
Result<ControllerProgram> controller_of(const Arguments& a) {
  if (!a.px4 && !a.ardupilot) return ControllerProgram{};
  const char* binary = std::getenv(a.px4 ? "FBVINS_PX4" : "FBVINS_ARDUPILOT");
  if (binary == nullptr || *binary == '\0')
    return Error{ErrorCode::invalid_argument, a.px4 ? "--px4: FBVINS_PX4 does not name bin/px4 of a px4_sitl build"
                                                    : "--ardupilot: FBVINS_ARDUPILOT does not name arducopter of a SITL build"};
  if (a.px4) return ControllerProgram{ControllerProgram::Kind::px4, binary, a.out + "/px4"};
  return ControllerProgram{ControllerProgram::Kind::ardupilot, binary, a.out + "/ardupilot"};
}

/// The vehicle stands on a level floor, to 0.2 degrees; the IMU is mounted on it to as much.
constexpr double kStandingTilt_rad = 0.005;

Result<void> stand_level(const SimulationOptions& simulation, Config& config) {
  StandingOptions& standing = config.estimator.standing;
  if (standing.tilt_rad > 0) return {};
  const Result<StereoRig> rig = simulated_rig(simulation);
  if (!rig) return rig.error();
  const Vec3 up_B = imu_mounting(*rig, simulation.flight.camera_pitch_deg).q.conjugate() * Vec3::UnitZ();
  standing = {kStandingTilt_rad, up_B.x(), up_B.y(), up_B.z()};
  return {};
}

/// Adds to `config` how the vehicle stands.
Result<FlightSetup> setup_of(const Arguments& a, Config& config) {
  FlightSetup setup;
  Result<Mission> mission = mission_of(a);
  if (!mission) return mission.error();
  Result<SimulationOptions> simulation = simulation_preset(a.preset);
  if (!simulation) return simulation.error();
  Result<QuadrotorOptions> vehicle = quadrotor_preset(a.vehicle);
  if (!vehicle) return vehicle.error();
  setup.mission = *std::move(mission);
  setup.simulation = *std::move(simulation);
  setup.simulation.seed = a.seed;
  setup.vehicle = *vehicle;
  setup.control = control_for(*vehicle);
  if (!a.control.empty())
    if (Result<void> read = read_yaml_file(a.control, fields_of(setup.control)); !read) return read.error();
  if (a.wind_mps >= 0) setup.wind.mean_mps = a.wind_mps, setup.wind.gust_mps = a.wind_mps * 2 / 3;
  if (Result<void> done = stand_level(setup.simulation, config); !done) return done.error();
  setup.estimator.options = config;
  setup.wall_rate = a.wall_rate;
  setup.live = config.live;
  setup.estimator.mode = a.threaded ? RunMode::threaded : RunMode::deterministic;
  if (a.record) setup.recording = a.out + "/recording";
  Result<ControllerProgram> controller = controller_of(a);
  if (!controller) return controller.error();
  setup.controller = *std::move(controller);
  setup.controller.in_map = a.loop;
  return setup;
}

Result<FlightRun> flown(const Arguments& a, const Config& config, FlightSetup setup) {
  FlightRun flight;
  SurvivalMeter survival;
  std::unique_ptr<LoopMap> map;
  if (a.loop) {
    Result<StereoRig> rig = simulated_rig(setup.simulation);
    if (!rig) return rig.error();
    Result<std::unique_ptr<LoopMap>> made = LoopMap::create(*rig, {.loop = config.loop});
    if (!made) return made.error();
    map = *std::move(made);
    setup.estimator.mapper = map.get();
  }
  setup.estimator.on_tracked_frame = [&](const TrackedFrame& f) {
    flight.run.tracked.push_back({f.id, f.t, f.stats, survival.add(f)});
  };
  FlightMode last = FlightMode::landed;
  Result<FlightLog> log = fly(setup, [&](double t_s, FlightMode mode) {
    if (!a.quiet && mode != last) note(fmt::format("{:6.2f} s: {}", t_s, to_string(mode)));
    last = mode;
  });
  if (!log) return log.error();
  flight.log = *std::move(log);
  flight.run.odometry = flight.log.odometry;
  flight.run.tracked.resize(std::min(flight.run.tracked.size(), flight.run.odometry.size()));
  return flight;
}

/// The files of `fbvins run`, for `fbvins report`.
Result<void> write_as_run(const Arguments& a, const Config& config, const FlightRun& flight, double wall_s) {
  std::vector<TrajectoryPoint> truth;
  Trajectory<W> poses;
  for (const TrueState& s : flight.log.imu.truth) {
    truth.push_back({s.t, s.T_WB, s.v_WB, s.bias});
    poses.push_back({s.t, s.T_WB});
  }
  RunSummary summary = summarise(flight.run, flight.run.images(), poses);
  summary.dataset = fmt::format("{}-{}-s{}", a.mission_name(), a.preset, a.seed);
  summary.frontend = config.frontend.kind;
  summary.mode = a.threaded ? "threaded" : "deterministic";
  summary.wall_s = wall_s;
  if (Result<void> done = write_run(flight.run, a.out); !done) return done;
  if (Result<void> done = write_truth(flight.run.images(), truth, a.out); !done) return done;
  return write_summary(summary, config, a.out);
}

/// The gains that were flown.
Result<void> write_control(const FlightSetup& setup, const std::string& out) {
  ControlOptions control = setup.control;
  return write_file_atomically(out + "/control.yaml", write_yaml(fields_of(control)));
}

int fly_mission(Arguments a) {
  Result<Config> config = a.config.load();
  if (!config) return fail(config.error().message);
  if (a.out.empty()) a.out = fmt::format("out/{}-{}-s{}-{}", a.mission_name(), a.preset, a.seed, config->frontend.kind);
  const Result<FlightSetup> setup = setup_of(a, *config);
  if (!setup) return fail(setup.error().message);
  if (Result<void> made = make_folders(a.out); !made) return fail(made.error().message);

  const auto start = std::chrono::steady_clock::now();
  const Result<FlightRun> flight = flown(a, *config, *setup);
  if (!flight) return fail(flight.error().message);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const FlightSummary summary = summarise(flight->log, setup->mission);
  const FlightFacts facts{a.mission_name(), a.preset, config->frontend.kind, a.vehicle, a.seed, a.loop, setup->controller.kind};
  for (const Result<void>& done :
       {write_as_run(a, *config, *flight, wall_s), write_flight(flight->log, a.out), write_control(*setup, a.out),
        write_files(a.out, {{"flight.json", flight_json_text(facts, flight->log, summary)},
                            {"flight.txt", flight_text(facts, flight->log, summary)}})})
    if (!done) return fail(done.error().message);
  if (!a.quiet) fmt::print("{}results in {}\n", flight_text(facts, flight->log, summary), bold(a.out));
  return summary.arrived ? kOk : kEstimationFailed;
}

}  // namespace

void add_fly_command(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("fly", kFlyDescription);
  command->footer(kExamples);
  command->add_option("MISSION", a->mission, "YAML file: takeoff, goto, hold, yaw, identify, land");
  command->add_flag("--identify", a->identify, "instead of a mission: excites every axis in turn, for `fbvins tune`");
  command->add_option("--preset", a->preset, "world and light (see fbvins simulate)")
      ->check(CLI::IsMember(simulation_presets()))
      ->capture_default_str();
  command->add_option("--seed", a->seed, "seed of world, wind and noise")->check(CLI::NonNegativeNumber)->capture_default_str();
  command->add_option("--out", a->out, "folder for the results (default out/<mission>-<preset>-s<seed>-<frontend>)");
  a->config.add_to(*command);
  command->add_option("--vehicle", a->vehicle, "the quadrotor")->check(CLI::IsMember(quadrotor_presets()))->capture_default_str();
  command->add_option("--control", a->control, "YAML file that changes gains and limits, by PX4's names");
  command->add_option("--wind", a->wind_mps, "mean wind in m/s, gusts of two thirds of it (default 0.3)")
      ->check(CLI::Range(0.0, 10.0));
  CLI::Option* wall = command
                          ->add_option("--wall-clock", a->wall_rate,
                                       "fly in wall time through a live system, this many seconds of the flight in one")
                          ->check(CLI::Range(0.05, 4.0));
  CLI::Option* px4 =
      command->add_flag("--px4", a->px4, "a real PX4 flies: FBVINS_PX4 names bin/px4 of its px4_sitl build (docs/px4.md)");
  CLI::Option* ardupilot = command->add_flag(
      "--ardupilot", a->ardupilot, "a real ArduPilot flies: FBVINS_ARDUPILOT names arducopter of its SITL build (docs/px4.md)");
  command->add_flag("--loop", a->loop, "loop closure: the mission is flown in the map's frame");
  command->add_flag("--record", a->record, "write images, IMU and truth as a recording to OUT/recording, too");
  wall->excludes(px4)->excludes(ardupilot);
  px4->excludes(ardupilot);
  command->add_flag("--threaded", a->threaded, "frontend and estimator on threads of their own; the same result");
  command->add_flag("--quiet", a->quiet, "print nothing but errors and warnings");
  command->callback([a, &exit_code] { exit_code = fly_mission(*a); });
}

}  // namespace fbvins::app
