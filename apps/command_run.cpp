// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>

#include "apps/commands.hpp"
#include "apps/config_arguments.hpp"
#include "apps/imu_state.hpp"
#include "apps/open_recording.hpp"
#include "apps/progress.hpp"
#include "apps/run_flight.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/no_pose.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kRunExamples =
    R"(Writes into --out: trajectory_tum.txt, trajectory.csv (EuRoC columns, covariance, health), covariance.csv, gauge.csv,
statistics.csv, config.yaml (the effective configuration), summary.json, summary.txt, timing.csv (docs/outputs.md). The same
input and configuration give the same bytes in the first six, with --threaded as well. Loop closure (--loop, --save-map,
--load-map, --final-ba, --positions, --tags) adds poses in the map frame M: map_trajectory_tum.txt (known after the run), map_causal_tum.txt and
map_bounded_tum.txt (as known at each moment, with and without steps), and map_updates.csv; the odometry stays the same.

examples:
  fbvins run MH_01_easy
  fbvins run MH_01_easy.zip --frontend orb --out /tmp/orb
  fbvins run MH_01_easy --frontend boost         orb with descriptors improved by the network
  fbvins run flight --calibration camchain-imucam.yaml --imu-calibration imu.yaml
  fbvins run MH_01_easy --config drone.yaml --set estimator.max_iterations=8 --threaded
  fbvins run flight.mcap --config flight.mcap    a flight record of fbvins live, as it was flown
  fbvins run monday --save-map flat.fbm          with loop closure, the map is saved
  fbvins run tuesday --load-map flat.fbm         relocalises in Monday's map and continues in its frame
)";

struct RunArguments {
  RecordingArguments recording;
  std::string out;
  ConfigArguments config;
  FlightArguments flight;
  int max_images = 0;
  bool quiet = false;
};

Result<std::string> make_folder(const RunArguments& arguments, const Config& config, const Dataset& data) {
  const std::string folder =
      arguments.out.empty() ? fmt::format("out/{}-{}", data.info().name, config.frontend.kind) : arguments.out;
  if (Result<void> made = make_folders(folder); !made) return made.error();
  if (std::error_code ignored; std::filesystem::exists(folder + "/summary.json", ignored))
    note(fmt::format("{}: holds the results of an earlier run, which are overwritten", folder));
  return folder;
}

/// For the same recording with the same calibration.
std::string doctor_command(const RecordingArguments& recording) {
  std::string out = "fbvins doctor " + recording.path;
  if (!recording.calibration.empty()) out += " --calibration " + recording.calibration;
  if (!recording.imu_calibration.empty()) out += " --imu-calibration " + recording.imu_calibration;
  if (!recording.topics.empty()) out += fmt::format(" --topics {}", fmt::join(recording.topics, ","));
  return out;
}

int run(const RunArguments& arguments) {
  const auto config = arguments.config.load();
  if (!config) return fail(config.error().message);
  const auto data = open_recording(arguments.recording, {.max_frames = arguments.max_images});
  if (!data) return fail(data.error().message);
  RecordingWarnings warnings;
  warnings.print((*data)->info());
  const auto folder = make_folder(arguments, *config, **data);
  if (!folder) return fail(folder.error().message);

  const auto flight = [&] {
    Progress progress(static_cast<int>((*data)->frames().size()), arguments.quiet);
    return run_flight(
        arguments.flight, *config, **data,
        {.on_frame = [&](int frames) { progress.update(frames); }, .on_finding = [](const Finding& f) { warn(to_text(f)); }});
  }();
  if (!flight) return fail(flight.error().message);
  warnings.print_at_end((*data)->info());
  if (const int repeated = flight->images_repeated; repeated > 0)
    warn(
        fmt::format("{} images are the same as an earlier one of their camera, though the vehicle has turned: they are left out; "
                    "look at the camera's driver, or at the program that recorded it",
                    repeated));

  const RunSummary summary = summarise(*flight, **data, *config, arguments.flight);
  if (Result<void> written = write_flight(*flight, summary, *config, (*data)->ground_truth(), *folder); !written)
    return fail(written.error().message);
  if (flight->map && !flight->map->not_saved.empty()) return fail(flight->map->not_saved);
  if (!arguments.quiet) fmt::print("{}results in {}\n", to_text(summary), bold(*folder));
  const bool has_poses = summary.coverage.with_pose > 0;
  const std::map<std::string, int> health(summary.health.begin(), summary.health.end());
  if (const std::string trouble = has_poses ? few_good_sentence(health, summary.restarts) : no_pose_sentence(health);
      !trouble.empty())
    warn(fmt::format("{}; `{}` examines the recording", trouble, doctor_command(arguments.recording)));
  return has_poses ? kOk : kEstimationFailed;
}

}  // namespace

void add_run_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = program.add_subcommand("run", "estimate the trajectory of a recording");
  command->footer(kRunExamples);
  arguments->recording.add_to(*command);
  arguments->config.add_to(*command);
  command->add_option("--out", arguments->out, "folder for the results (default out/<dataset>-<frontend>)");
  command->add_option("--imu-state", arguments->flight.imu_state, kImuStateHelp);
  command->add_option("--max-images", arguments->max_images, "stop after this many stereo images, 0 for all")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--threaded", arguments->flight.threaded, "frontend and estimator on threads of their own; the same result");
  arguments->flight.map.add_to(*command);
  command->add_flag("--final-ba", arguments->flight.map.final_ba,
                    "bundle adjustment over the whole map after the run; with loop closure");
  command->add_flag("--boosted-map", arguments->flight.map.boosted, "a new map of boosted descriptors; with loop closure");
  command->add_option("--positions", arguments->flight.map.positions,
                      "CSV of positions or heights in the building's frame; with loop closure (docs/maps.md)");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace fbvins::app
