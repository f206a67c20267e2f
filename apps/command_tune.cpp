// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/tuning/tune_report.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Identifies the vehicle's response from a flight's log, axis by axis, and proposes gains under PX4's names (docs/flight.md).
The flight should excite every axis, as `fbvins fly --identify` does. The log is the folder of `fbvins fly`, or a .ulg of PX4 with
SDLOG_PROFILE 17 (default and high rate).
Writes control.yaml (for `fbvins fly --control`), gains.params (for QGroundControl), tuning.txt, tuning.svg (before and after).

examples:
  fbvins fly --identify --out first && fbvins tune first --out tuned
  fbvins fly --identify --control tuned/control.yaml --out second && fbvins tune second --out again
  fbvins tune flight.ulg --phase-margin 55
)";

struct Arguments {
  std::string log, out = "out/tuning";
  TuneOptions options;
  bool truth = false, quiet = false;
};

int tune_gains(const Arguments& a) {
  const Result<LoopLog> log = read_loop_log(a.log, a.truth ? VelocitySource::truth : VelocitySource::estimate);
  if (!log) return fail(log.error().message);
  const Result<VehicleFit> fit = fit_vehicle(*log);
  if (!fit) return fail(fit.error().message);
  const Tuning tuning = tune(*log, *fit, a.options);
  const std::string text = tuning_text(tuning, a.options);
  const Result<void> done = write_files(a.out, {{"control.yaml", control_yaml(tuning.proposed)},
                                                {"gains.params", px4_parameter_file(tuning)},
                                                {"tuning.txt", text},
                                                {"tuning.svg", tuning_svg(tuning)}});
  if (!done) return fail(done.error().message);
  if (!a.quiet) fmt::print("{}results in {}\n", text, bold(a.out));
  return kOk;
}

}  // namespace

void add_tune_command(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("tune", kTuneDescription);
  command->footer(kExamples);
  command->add_option("FLIGHT", a->log, "folder of `fbvins fly`, or a log of PX4 (.ulg)")->required();
  command->add_option("--phase-margin", a->options.phase_margin_deg, "smallest phase margin of every loop, degrees")
      ->check(CLI::Range(20.0, 80.0))
      ->capture_default_str();
  command->add_option("--out", a->out, "folder for the results")->capture_default_str();
  command->add_flag("--truth", a->truth, "use the simulator's true velocities instead of the estimated ones");
  command->add_flag("--quiet", a->quiet, "print nothing but errors and warnings");
  command->callback([a, &exit_code] { exit_code = tune_gains(*a); });
}

}  // namespace fbvins::app
