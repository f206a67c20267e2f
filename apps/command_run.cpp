// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/progress.hpp"
#include "apps/run_output.hpp"
#include "apps/run_summary.hpp"
#include "apps/terminal.hpp"
#include "fbvins/config/config_file.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/pipeline/system.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Writes into --out: trajectory_tum.txt, trajectory.csv (EuRoC columns, covariance, health), statistics.csv,
config.yaml (the effective configuration), summary.json, summary.txt, timing.csv. The same input and
configuration give the same bytes in the first four, with --threaded as well.

examples:
  fbvins run MH_01_easy
  fbvins run MH_01_easy.zip --frontend orb --out /tmp/orb
  fbvins run flight --calibration camchain-imucam.yaml --imu-calibration imu.yaml
  fbvins run MH_01_easy --config drone.yaml --set estimator.max_iterations=8 --threaded
)";

struct Arguments {
  std::string dataset, config, frontend, out, camchain, imu_calibration;
  std::vector<std::string> assignments;
  int max_images = 0;
  bool threaded = false, quiet = false;
};

Result<Config> config_of(Arguments arguments) {
  if (!arguments.frontend.empty())
    arguments.assignments.insert(arguments.assignments.begin(), "frontend.kind=" + arguments.frontend);
  return load_config(arguments.config, arguments.assignments);
}

Result<std::unique_ptr<Dataset>> open(const Arguments& arguments) {
  DatasetOptions options;
  options.max_frames = arguments.max_images;
  options.kalibr_camchain = arguments.camchain;
  options.kalibr_imu = arguments.imu_calibration;
  return open_dataset(arguments.dataset, options);
}

Result<std::string> make_folder(const Arguments& arguments, const Config& config, const Dataset& data) {
  const std::string folder =
      arguments.out.empty() ? fmt::format("out/{}-{}", data.info().name, config.frontend.kind) : arguments.out;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", folder, error.message())};
  return folder;
}

/// Sends the whole recording through the system.
Result<RunRecord> process(const Config& config, Dataset& data, RunMode mode, Progress& progress) {
  RunRecord record;
  record.tracked.reserve(data.frames().size());
  record.odometry.reserve(data.frames().size());
  System system(config, data.rig(), mode);
  system.on_tracked_frame([&](const TrackedFrame& f) { record.tracked.push_back({f.id, f.t, f.stats}); });
  system.on_odometry([&](const Odometry& o) { record.odometry.push_back(o); });
  int frames = 0;
  while (auto event = data.next()) {
    const bool is_frame = std::holds_alternative<StereoFrame>(*event);
    system.push(std::move(*event));
    if (is_frame) progress.update(++frames);
  }
  if (Result<void> done = system.finish(); !done) return done.error();
  return record;
}

Result<void> write_all(const RunRecord& record, const RunSummary& summary, const Config& config, const std::string& folder) {
  if (Result<void> done = write_trajectories(record, folder); !done) return done;
  if (Result<void> done = write_statistics(record, folder); !done) return done;
  if (Result<void> done = write_timing(record, folder); !done) return done;
  if (Result<void> done = write_text(folder + "/config.yaml", to_yaml(config)); !done) return done;
  if (Result<void> done = write_text(folder + "/summary.json", to_json_text(summary)); !done) return done;
  return write_text(folder + "/summary.txt", to_text(summary));
}

int run(const Arguments& arguments) {
  const auto config = config_of(arguments);
  if (!config) return fail(config.error().message);
  const auto data = open(arguments);
  if (!data) return fail(data.error().message);
  for (const std::string& warning : (*data)->info().warnings) warn(warning);
  const auto folder = make_folder(arguments, *config, **data);
  if (!folder) return fail(folder.error().message);

  const RunMode mode = arguments.threaded ? RunMode::threaded : RunMode::deterministic;
  double wall_s = 0;
  const auto record = [&] {
    Progress progress(static_cast<int>((*data)->frames().size()), arguments.quiet);
    auto result = process(*config, **data, mode, progress);
    wall_s = progress.elapsed_s();
    return result;
  }();
  if (!record) return fail(record.error().message);

  RunSummary summary = summarise(*record, **data);
  summary.frontend = config->frontend.kind;
  summary.mode = arguments.threaded ? "threaded" : "deterministic";
  summary.wall_s = wall_s;
  if (Result<void> written = write_all(*record, summary, *config, *folder); !written) return fail(written.error().message);
  if (!arguments.quiet) fmt::print("{}results in {}\n", to_text(summary), bold(*folder));
  if (summary.coverage.with_pose > 0) return kOk;
  warn("no pose could be estimated; the health column of trajectory.csv says why");
  return kEstimationFailed;
}

}  // namespace

void add_run_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("run", "estimate the trajectory of a recording");
  command->footer(kExamples);
  command->add_option("DATASET", arguments->dataset, "EuRoC folder or zip")->required();
  command->add_option("--config", arguments->config, "YAML file that changes the defaults (see fbvins config)");
  command->add_option("--set", arguments->assignments, "one option, name=value; may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--frontend", arguments->frontend, "how features are followed")->check(CLI::IsMember({"klt", "orb"}));
  command->add_option("--out", arguments->out, "folder for the results (default out/<dataset>-<frontend>)");
  command->add_option("--calibration", arguments->camchain, "Kalibr camchain-imucam.yaml instead of the recording's own");
  command->add_option("--imu-calibration", arguments->imu_calibration, "Kalibr imu.yaml, with --calibration");
  command->add_option("--max-images", arguments->max_images, "stop after this many stereo images, 0 for all")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--threaded", arguments->threaded, "frontend and estimator on threads of their own; the same result");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace fbvins::app
