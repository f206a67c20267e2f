// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/config_arguments.hpp"
#include "apps/first_look.hpp"
#include "apps/imu_state.hpp"
#include "apps/injected_faults.hpp"
#include "apps/kept_map.hpp"
#include "apps/live_check.hpp"
#include "apps/live_outputs.hpp"
#include "apps/live_summary.hpp"
#include "apps/open_recording.hpp"
#include "apps/open_source.hpp"
#include "apps/ros_graph.hpp"
#include "apps/run_map.hpp"
#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"
#include "apps/web_page.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/live/replay_source.hpp"
#include "fbvins/live/reset_counter_sink.hpp"
#include "fbvins/pipeline/stage_runner.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Estimates the pose from sensor data as they come, at IMU rate. Ends with its source, or at Ctrl-C. Without --quiet a status
line, one JSON object, is printed whenever health changes and once a second. --out writes the files of `fbvins run` while
the flight goes on, live_tum.txt (poses at IMU rate) and summary.json (latency, dropped images, health; accuracy if the
source is a recording with ground truth).

sources:
  replay:DATASET[@SPEED]     a recording played in wall time
  socket:PATH                another process, over a Unix socket (docs/socket.md); it sends its calibration, unless --calibration is given
  ros2:CAM0,CAM1,...,IMU     ROS 2 topics, in the domain of --ros2 (docs/ros2.md); needs --calibration; with depth=TOPIC depth images
  d435i[:SERIAL or FILE.bag][:depth][:848x480@60]  a RealSense camera with an IMU, by its factory calibration (docs/d435i.md)
  oak[:DEVICE][:@HZ], orbbec[:SERIAL][:640x480@30], zed[:/dev/videoN]:672x376  by their makers' Python packages (docs/devices.md)
  v4l2:CAM0,CAM1,...,IMU     video devices, or one with all images side by side; the IMU is a flight controller's (udp:..., serial:...)
                             or another process's (socket:...); needs --calibration (docs/devices.md)

examples:
  fbvins live --source replay:MH_01_easy --out out/live
  fbvins live --source replay:MH_01_easy@4 --frontend orb --quiet --out out/fast
  fbvins live --source socket:/run/fbvins/sensors.sock --out out/live
  fbvins live --source replay:MH_01_easy --map flat.fbm
  fbvins live --source replay:MH_01_easy --mavlink udp:127.0.0.1:14580 --set live.mavlink.rate_hz=30
  fbvins live --source replay:MH_01_easy --record flight.mcap
  fbvins live --source replay:MH_01_easy --web 8080
  fbvins live --source socket:/run/fbvins/sensors.sock --check 10       before the first flight: rates, gaps, clocks, and what the doctor finds
)";

struct Arguments {
  std::string source, kept_map, ros2, imu_state, socket_group;
  std::vector<std::string> faults;
  OutputArguments outputs;
  ConfigArguments config;
  DatasetOptions dataset;
  MapArguments map;
  int laps = 1;
  bool preload = false;
  double check_s = 0;  ///< check the sensors for so long, and estimate nothing
};

/// The map of --map is loaded, if the file exists, and saved.
MapArguments map_arguments(const Arguments& arguments) {
  if (arguments.kept_map.empty()) return arguments.map;
  MapArguments map = arguments.map;
  map.save = arguments.kept_map;
  if (std::filesystem::exists(arguments.kept_map)) map.load = arguments.kept_map;
  return map;
}

Result<void> fly(Source& source, LiveSystem& live, const std::vector<std::string>& faults) {
  const StopSignal stop([&] { source.stop(); });
  live.on_failure([&] { source.stop(); });
  FirstLook look(live.input(), source.rig(), [](const Finding& finding) { warn(to_text(finding)); });
  const Result<void> ended = run_with_faults(source, look, faults);
  const Result<void> done = live.finish();
  return ended ? done : ended;
}

Result<void> write_results(const std::string& folder, const Config& config, const Source& source, const LiveSummary& summary) {
  if (Result<void> done = write_file_atomically(folder + "/config.yaml", to_yaml(config)); !done) return done;
  if (const auto* replay = dynamic_cast<const ReplaySource*>(&source); replay && replay->dataset().has_ground_truth()) {
    std::vector<Time> images;
    for (const FrameEntry& frame : replay->dataset().frames()) images.push_back(frame.t);
    if (Result<void> done = write_truth(images, replay->dataset().ground_truth(), folder); !done) return done;
  }
  if (Result<void> done = write_file_atomically(folder + "/summary.json", to_json_text(summary)); !done) return done;
  return write_file_atomically(folder + "/summary.txt", to_text(summary));
}

Result<std::unique_ptr<Source>> source_of(const Arguments& arguments, const RosGraph& graph) {
  const Result<DatasetOptions> dataset = with_calibration(arguments.dataset);
  if (!dataset) return dataset.error();
  const SourceOptions options{.dataset = *dataset,
                              .laps = arguments.laps,
                              .preload = arguments.preload,
                              .say = note,
                              .give_up = stop_is_wanted,
                              .socket_group = arguments.socket_group};
  return graph.has_source() ? graph.open_source(options) : open_source(arguments.source, options);
}

/// From the first reading to the end of the outputs.
Result<void> fly_with_outputs(const Arguments& arguments, const Config& config, Source& source, const RosGraph& graph,
                              KeptMap* kept, LoopMap* map, LiveTotals& totals, Troubles& troubles) {
  std::unique_ptr<ResetCounterSink> counter;
  if (!arguments.outputs.reset_counter.empty()) counter = std::make_unique<ResetCounterSink>(arguments.outputs.reset_counter);
  if (counter && counter->was_unreadable())
    warn(fmt::format("{}: there is no reset counter in it; the first one is {}", arguments.outputs.reset_counter,
                     counter->first()));
  LiveFlight flight{config, source, arguments.source, arguments.map, kept, map};  // before `live`, whose commands use it
  SystemParts parts{.mapper = kept, .imu_state = imu_state_for_flight(arguments.imu_state, source.rig().imu_noise)};
  auto live = LiveSystem::create(config, config.live, source.rig(), source.clock_rate(), std::move(parts),
                                 counter ? counter->first() : 0);
  if (!live) return live.error();
  if (auto sink = source.status_sink()) live->add_sink(std::move(sink));
  if (counter) live->add_sink(std::move(counter));
  if (Result<void> added = add_outputs(arguments.outputs, flight, *live, totals, troubles); !added) return added;
  if (Result<void> added = graph.add_sinks(source, config.live, *live); !added) return added;
  if (Result<void> good = check_faults(arguments.faults, source.rig().camera_count()); !good) return good;
  if (Result<void> added = add_page(arguments.outputs.web, flight, *live); !added)
    return added;  // last: its viewers reach the others
  const Result<void> flown = fly(source, *live, arguments.faults);
  if (kept) kept->finish();
  totals.last = live->status();
  return flown;
}

/// Every file is tried, whatever became of the others.
void save(const Arguments& arguments, const Config& config, const Source& source, LoopMap* map, const LiveTotals& totals,
          Troubles& troubles) {
  troubles.add(save_imu_state(arguments.imu_state, totals.imu_state, source.rig().imu_noise));
  if (map) {
    troubles.add(guarded("loop closure", [&] { map->finish(); }));
    for (const auto& [session, why] : map->not_joined())
      warn(fmt::format("session {} of this flight is no part of the map: {}", session, why));
    const std::string damage = map->damage();
    if (!damage.empty() && !arguments.kept_map.empty()) {
      retire_kept_map(arguments.kept_map, damage);
    } else {
      if (!damage.empty()) warn(damage);
      troubles.add(save_map(arguments.map, *map));
    }
  }
  const std::string& folder = arguments.outputs.out;
  const LiveSummary summary = summarise(totals, arguments.source, config.frontend.kind, source, folder);
  if (!folder.empty()) troubles.add(write_results(folder, config, source, summary));
  if (!arguments.outputs.quiet) tell(to_text(summary));
}

int run(Arguments arguments) {
  const StopSignals signals;  // before any thread is made
  const auto config = arguments.config.load();
  if (!config) return fail(config.error().message);
  if (const Result<void> good = check_faults(arguments.faults, kMostCameras); !good) return fail(good.error().message);
  const auto graph = RosGraph::join(arguments.ros2, arguments.source, config->live.ros2);
  if (!graph) return fail(graph.error().message);
  const auto source = source_of(arguments, *graph);
  if (!source) return fail(source.error().message);
  if (const auto* replay = dynamic_cast<const ReplaySource*>(source->get())) RecordingWarnings().print(replay->dataset().info());
  if (arguments.check_s > 0) return check_sensors(**source, arguments.check_s);
  const StereoRig& rig = (*source)->rig();
  const auto map =
      arguments.kept_map.empty() ? make_map(arguments.map, rig, config->loop) : make_kept_map(arguments.map, rig, config->loop);
  if (!map) return fail(map.error().message);
  std::unique_ptr<Mapper> with_tags;
  const Result<Mapper*> mapper = mapper_of(arguments.map, rig, map->get(), with_tags);
  if (!mapper) return fail(mapper.error().message);
  std::optional<KeptMap> kept;
  const std::string kept_file = arguments.kept_map.empty() ? "" : arguments.map.save;
  if (*map)
    kept.emplace(**mapper,
                 KeptMap::Source{[from = map->get()] { return from->bytes(); },
                                 [from = map->get()](bool anew) { return from->news(anew); }},
                 kept_file);
  if (kept) kept->save_requested_to(arguments.map.save);
  LiveTotals totals;
  Troubles troubles;
  troubles.add(fly_with_outputs(arguments, *config, **source, *graph, kept ? &*kept : nullptr, map->get(), totals, troubles));
  if (totals.last.host_t == Time{}) return kBadInput;  // it did not fly
  save(arguments, *config, **source, map->get(), totals, troubles);
  if (troubles.any()) return kBadInput;
  return totals.with_pose > 0 ? kOk : kEstimationFailed;
}

}  // namespace

void add_live_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("live", kLiveDescription);
  command->footer(kExamples);
  command->add_option("--source", arguments->source, "where sensor data come from")->required();
  arguments->config.add_to(*command);
  arguments->outputs.add_to(*command);
  command->add_option("--calibration", arguments->dataset.kalibr_camchain,
                      "calibration file instead of the source's own, of every kind that `fbvins run` reads");
  command->add_option("--imu-calibration", arguments->dataset.kalibr_imu,
                      "the IMU alone, with --calibration: imu.yaml of Kalibr or OpenVINS, or axes in RealSense's JSON");
  command->add_option("--imu-state", arguments->imu_state, kImuStateHelp);
  command->add_option("--max-images", arguments->dataset.max_frames, "replay: end after this many stereo images, 0 for all")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--laps", arguments->laps, "replay: play the recording this often")->check(CLI::PositiveNumber);
  command
      ->add_option("--pair-tolerance", arguments->dataset.pair_tolerance_ms,
                   "ms by which the stamps of images that are taken at once may differ")
      ->check(CLI::Range(0.0, 1000.0));
  command->add_flag("--preload", arguments->preload, "replay: decode all images before the clock starts");
  arguments->map.add_to(*command);
  command
      ->add_option(
          "--map", arguments->kept_map,
          "a map kept from flight to flight: loaded if the file exists, kept every half minute and written at the end; with loop closure")
      ->excludes("--save-map")
      ->excludes("--load-map");
  command->add_option("--ros2", arguments->ros2,
                      "publish ROS 2 topics: DOMAIN[:INTERFACE]; without an interface to this machine alone");
  command
      ->add_option("--socket-group", arguments->socket_group,
                   "a Unix group that may connect to the sensors' socket; without it its owner alone")
      ->take_last();
  command->add_option("--check", arguments->check_s, "check the sensors for this many seconds, print what is wrong, and end")
      ->check(CLI::PositiveNumber);
  add_fault_option(*command, arguments->faults);
  command->callback([arguments, &exit_code] {
    arguments->map = map_arguments(*arguments);
    exit_code = run(*arguments);
  });
}

}  // namespace fbvins::app
