// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/io/output_file.hpp"
#include "fbvins/report/report.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(RUN is a folder that `fbvins run` wrote. The page is complete in itself: open it from disk, send it, print it.

examples:
  fbvins report out/MH_01_easy-boost out/MH_01_easy-klt -o report.html      both, in the same figures
  fbvins report out/flight-boost --truth groundtruth.csv                    if the recording has no ground truth
)";

struct Arguments {
  std::vector<std::string> runs;
  std::string out = "report.html", truth, title;
  bool quiet = false;
};

std::string title_of(const std::vector<RunFolder>& runs) {
  std::vector<std::string> datasets;
  for (const RunFolder& run : runs)
    if (std::find(datasets.begin(), datasets.end(), run.dataset) == datasets.end()) datasets.push_back(run.dataset);
  if (datasets.size() > 3) return fmt::format("{} recordings", datasets.size());
  std::string title;
  for (const std::string& dataset : datasets) title += (title.empty() ? "" : ", ") + dataset;
  return title;
}

int write_report(const Arguments& arguments) {
  std::vector<RunFolder> runs;
  for (const std::string& path : arguments.runs) {
    Result<RunFolder> run = read_run_folder(path, arguments.truth);
    if (!run) return fail(run.error().message);
    if (run->truth.empty()) warn(path + ": no ground truth, so no errors (--truth gives one)");
    runs.push_back(*std::move(run));
  }
  ReportOptions options;
  options.title = arguments.title.empty() ? title_of(runs) : arguments.title;
  Result<OutputFile> file = OutputFile::create(arguments.out);
  if (!file) return fail(file.error().message);
  file->write(report_html(runs, nullptr, options));
  if (Result<void> done = file->close(); !done) return fail(done.error().message);
  if (!arguments.quiet) fmt::print("report: {}\n", bold(std::filesystem::absolute(arguments.out).lexically_normal().string()));
  return kOk;
}

}  // namespace

void add_report_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("report", "show runs in one HTML page: trajectory, errors, health, time");
  command->footer(kExamples);
  command->add_option("RUN", arguments->runs, "folders of fbvins run")->required();
  command->add_option("-o,--out", arguments->out, "the page")->capture_default_str();
  command->add_option("--truth", arguments->truth, "recording or trajectory file with the truth of all these runs");
  command->add_option("--title", arguments->title, "heading of the page (default: the recordings' names)");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  command->callback([arguments, &exit_code] { exit_code = write_report(*arguments); });
}

}  // namespace fbvins::app
