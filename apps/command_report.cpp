// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/report/report.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kReportExamples =
    R"(RUN is a folder that `fbvins run` wrote. The page is complete in itself: open it from disk, send it, print it.

examples:
  fbvins report out/MH_01_easy-boost out/MH_01_easy-klt -o report.html      both, in the same figures
  fbvins report out/flight-boost --truth groundtruth.csv                    if the recording has no ground truth
)";

struct ReportArguments {
  std::vector<std::string> runs;
  std::string out = "report.html", truth;
  bool quiet = false;
};

int write(const ReportArguments& arguments) {
  const auto written = write_report(arguments.runs, arguments.out, arguments.truth);
  if (!written) return fail(written.error().message);
  for (const std::string& warning : *written) warn(warning);
  if (!arguments.quiet) fmt::print("report: {}\n", bold(std::filesystem::absolute(arguments.out).lexically_normal().string()));
  return kOk;
}

}  // namespace

void add_report_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command = program.add_subcommand("report", "show runs in one HTML page: trajectory, errors, health, time");
  command->footer(kReportExamples);
  command->add_option("RUN", arguments->runs, "folders of fbvins run")->required();
  command->add_option("-o,--out", arguments->out, "the page")->capture_default_str();
  command->add_option("--truth", arguments->truth, "recording or trajectory file with the truth of all these runs");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = write(*arguments); });
}

}  // namespace fbvins::app
