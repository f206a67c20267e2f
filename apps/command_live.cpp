// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/config_arguments.hpp"
#include "apps/imu_state.hpp"
#include "apps/kept_map.hpp"
#include "apps/live_check.hpp"
#include "apps/live_files.hpp"
#include "apps/live_summary.hpp"
#include "apps/open_source.hpp"
#include "apps/ros_graph.hpp"
#include "apps/run_map.hpp"
#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"
#include "apps/web_page.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/live/mavlink_sink.hpp"
#include "fbvins/live/record_sink.hpp"
#include "fbvins/live/replay_source.hpp"
#include "fbvins/live/sensor_faults.hpp"
#include "fbvins/live/service_sink.hpp"
#include "fbvins/live/status_sink.hpp"

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
  ros2:LEFT,RIGHT,IMU        ROS 2 topics, in the domain of --ros2 (docs/ros2.md); needs --calibration
  d435i[:SERIAL or FILE.bag] a RealSense camera with an IMU, by its factory calibration (docs/d435i.md)
  v4l2:LEFT,RIGHT,IMU        video devices, or one with two images side by side; the IMU is a flight controller's (udp:..., serial:...)
                             or another process's (socket:...); needs --calibration (docs/v4l2.md)
faults to inject for tests, in seconds of the flight (KIND:START:LENGTH[:AMOUNT]):
  camera_off, left_off, right_off, left_frozen, right_frozen, imu_off, unplugged, lose_images:..:SHARE,
  burst:..:HELD_BACK, leap:..:SECONDS

examples:
  fbvins live --source replay:MH_01_easy --out out/live
  fbvins live --source replay:MH_01_easy@4 --frontend orb --quiet --out out/fast
  fbvins live --source socket:/run/fbvins.sock --out out/live
  fbvins live --source replay:MH_01_easy --map flat.fbm
  fbvins live --source replay:MH_01_easy --mavlink udp:127.0.0.1:14580 --set live.mavlink.rate_hz=30
  fbvins live --source replay:MH_01_easy --record flight.mcap
  fbvins live --source replay:MH_01_easy --web 8080
  fbvins live --source socket:/run/fbvins.sock --check 10       before the first flight: rates, gaps, clocks, and what the doctor finds
  fbvins live --source replay:MH_01_easy --fault camera_off:8:2 --fault leap:12:1:0.5
)";

struct Arguments {
  std::string source, out, record, kept_map, ros2, imu_state, web;
  std::vector<std::string> faults, mavlink;
  ConfigArguments config;
  DatasetOptions dataset;
  MapArguments map;
  bool record_images = true, quiet = false;
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

Result<std::vector<SensorFault>> faults_of(const Arguments& arguments) {
  std::vector<SensorFault> faults;
  for (const std::string& text : arguments.faults) {
    auto fault = parse_fault(text);
    if (!fault) return fault.error();
    faults.push_back(*fault);
  }
  return faults;
}

/// The sinks that the command line asks for; the one that writes files, if any, also wants to see the frontend's frames.
Result<void> add_sinks(const Arguments& arguments, const Config& config, const Source& source, LiveSystem& live,
                       LiveTally& tally) {
  live.add_sink(tally.make_sink());
  if (!arguments.record.empty()) {
    auto record = RecordSink::create(
        arguments.record, source.rig(),
        {.program = "fbvins " FBVINS_VERSION, .configuration = to_yaml(config), .images = arguments.record_images});
    if (!record) return record.error();
    live.add_sink(std::move(*record));
  }
  if (const char* address = std::getenv("NOTIFY_SOCKET")) {
    auto sink = ServiceSink::create(address, stderr);
    if (!sink) return sink.error();
    live.add_sink(*std::move(sink));
  } else if (!arguments.quiet) {
    live.add_sink(std::make_unique<StatusSink>(stdout));
  }
  for (const std::string& address : arguments.mavlink) {
    auto sink = MavlinkSink::create(address, config.live.mavlink);
    if (!sink) return sink.error();
    live.add_sink(*std::move(sink));
  }
  if (arguments.out.empty()) return {};
  auto files = LiveFiles::create(arguments.out, arguments.map.wanted(), arguments.map.load.empty());
  if (!files) return files.error();
  live.on_tracked_frame([to = files->get()](const TrackedFrame& frame) { to->add(frame); });
  live.add_sink(std::move(*files));
  return {};
}

/// Why the page's button cannot save the map; empty: it can.
std::string cannot_save_map(const Arguments& arguments) {
  if (!arguments.map.wanted()) return "this flight has no map: start it with --map FILE";
  if (arguments.map.save.empty()) return "no file for the map was named: start with --map FILE or --save-map FILE";
  return {};
}

/// The page and its buttons, where one is wanted.
Result<void> add_page(const Arguments& arguments, const Config& config, LiveSystem& live, KeptMap* map) {
  if (arguments.web.empty()) return {};
  auto page = open_live_page({.where = arguments.web,
                              .source = arguments.source,
                              .frontend = config.frontend.kind,
                              .cannot_save_map = cannot_save_map(arguments),
                              .mark = [&live](std::string text) { live.mark(std::move(text)); },
                              .save_map = [map] { map->request_save(); }});
  if (!page) return page.error();
  if (map) {
    const std::string& file = arguments.map.save;
    map->on_request(file, [file, tell = page->tell](const Result<void>& saved) {
      tell(saved ? "the map is saved in " + file : saved.error().message, !saved);
    });
  }
  live.add_sink(std::move(page->sink));
  return {};
}

Result<void> fly(Source& source, LiveSystem& live, const std::vector<SensorFault>& faults) {
  const StopSignal stop([&] { source.stop(); });
  live.on_failure([&] { source.stop(); });
  Result<void> ended;
  if (faults.empty()) {
    ended = source.run(live.input());
  } else {
    FaultyInput faulty(live.input(), faults);
    ended = source.run(faulty);
  }
  const Result<void> done = live.finish();
  return ended ? done : ended;
}

Result<void> write_results(const Arguments& arguments, const Config& config, const Source& source, const LiveSummary& summary) {
  if (Result<void> done = write_text(arguments.out + "/config.yaml", to_yaml(config)); !done) return done;
  if (const auto* replay = dynamic_cast<const ReplaySource*>(&source); replay && replay->dataset().has_ground_truth()) {
    std::vector<Time> images;
    for (const FrameEntry& frame : replay->dataset().frames()) images.push_back(frame.t);
    if (Result<void> done = write_truth(images, replay->dataset().ground_truth(), arguments.out); !done) return done;
  }
  if (Result<void> done = write_text(arguments.out + "/summary.json", to_json_text(summary)); !done) return done;
  return write_text(arguments.out + "/summary.txt", to_text(summary));
}

int run(const Arguments& arguments) {
  block_stop_signals();  // before any thread is made
  const auto config = arguments.config.load();
  if (!config) return fail(config.error().message);
  const auto faults = faults_of(arguments);
  if (!faults) return fail(faults.error().message);
  const auto graph = RosGraph::join(arguments.ros2, arguments.source);
  if (!graph) return fail(graph.error().message);
  const SourceOptions options{
      .dataset = arguments.dataset, .laps = arguments.laps, .preload = arguments.preload, .say = note, .give_up = stop_is_wanted};
  const auto source = graph->has_source() ? graph->open_source(options) : open_source(arguments.source, options);
  if (!source) return fail(source.error().message);
  if (!arguments.out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(arguments.out, error);
    if (error) return fail(fmt::format("{}: {}", arguments.out, error.message()));
  }
  if (arguments.check_s > 0) return check_sensors(**source, arguments.check_s);
  const auto map = make_map(arguments.map, (*source)->rig(), config->loop);
  if (!map) return fail(map.error().message);
  std::optional<KeptMap> kept;
  if (*map) kept.emplace(**map, arguments.kept_map);
  const ImuNoise& imu = (*source)->rig().imu_noise;
  const auto imu_state = load_imu_state(arguments.imu_state, imu);
  if (!imu_state) return fail(imu_state.error().message);
  LiveTally tally;
  const Result<void> flown = [&]() -> Result<void> {
    auto live = LiveSystem::create(*config, config->live, (*source)->rig(), (*source)->clock_rate(),
                                   {.mapper = kept ? &*kept : nullptr, .imu_state = *imu_state});
    if (!live) return live.error();
    if (auto sink = (*source)->status_sink()) live->add_sink(std::move(sink));
    if (Result<void> added = add_sinks(arguments, *config, **source, *live, tally); !added) return added;
    if (Result<void> added = graph->add_sink(**source, *live); !added) return added;
    if (Result<void> added = add_page(arguments, *config, *live, kept ? &*kept : nullptr); !added) return added;
    const Result<void> done = fly(**source, *live, *faults);
    tally.last = live->status();
    return done;
  }();
  if (!flown) return fail(flown.error().message);
  if (Result<void> saved = save_imu_state(arguments.imu_state, tally.imu_state, imu); !saved) return fail(saved.error().message);
  if (*map) {
    (*map)->finish();
    if (Result<void> saved = save_map(arguments.map, **map); !saved) return fail(saved.error().message);
  }
  const LiveSummary summary = summarise(tally, arguments.source, config->frontend.kind, **source, arguments.out);
  if (!arguments.out.empty())
    if (Result<void> written = write_results(arguments, *config, **source, summary); !written)
      return fail(written.error().message);
  if (!arguments.quiet) std::fputs(to_text(summary).c_str(), stderr);
  return tally.with_pose > 0 ? kOk : kEstimationFailed;
}

}  // namespace

void add_live_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("live", kLiveDescription);
  command->footer(kExamples);
  command->add_option("--source", arguments->source, "where sensor data come from")->required();
  arguments->config.add_to(*command);
  command->add_option("--out", arguments->out, "folder for the results; without it no files are written");
  command->add_option("--calibration", arguments->dataset.kalibr_camchain,
                      "Kalibr camchain-imucam.yaml instead of the source's own");
  command->add_option("--imu-calibration", arguments->dataset.kalibr_imu, "Kalibr imu.yaml, with --calibration");
  command->add_option("--imu-state", arguments->imu_state, kImuStateHelp);
  command->add_option("--max-images", arguments->dataset.max_frames, "replay: end after this many stereo images, 0 for all")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--laps", arguments->laps, "replay: play the recording this often")->check(CLI::PositiveNumber);
  command->add_flag("--preload", arguments->preload, "replay: decode all images before the clock starts");
  command->add_flag("--loop", arguments->map.loop, "loop closure: a map beside the odometry");
  command->add_option("--save-map", arguments->map.save, "file for the map at the end; with loop closure");
  command->add_option("--load-map", arguments->map.load, "map to relocalise in and extend; with loop closure");
  command
      ->add_option(
          "--map", arguments->kept_map,
          "a map kept from flight to flight: loaded if the file exists, written every half minute and at the end; with loop closure")
      ->excludes("--save-map")
      ->excludes("--load-map");
  command->add_option("--vocabulary", arguments->map.vocabulary,
                      "vocabulary file for loop closure, instead of the one that ships");
  command
      ->add_option("--mavlink", arguments->mavlink,
                   "a flight controller to send poses to, udp:HOST:PORT[:OWN_PORT] or serial:DEVICE:BAUD; may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--ros2", arguments->ros2,
                      "publish ROS 2 topics: DOMAIN[:INTERFACE]; without an interface to this machine alone");
  command->add_option("--web", arguments->web, kWebHelp);
  command->add_option("--check", arguments->check_s, "check the sensors for this many seconds, print what is wrong, and end")
      ->check(CLI::PositiveNumber);
  command->add_option("--fault", arguments->faults, "sensor fault to inject (see below); may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--record", arguments->record, "MCAP file for the flight record; it is a recording for fbvins run");
  command->add_flag("!--record-no-images", arguments->record_images,
                    "leave images out of the record, which cannot be run again then");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] {
    arguments->map = map_arguments(*arguments);
    exit_code = run(*arguments);
  });
}

}  // namespace fbvins::app
