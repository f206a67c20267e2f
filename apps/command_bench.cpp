// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <thread>

#include "apps/command_line.hpp"
#include "apps/commands.hpp"
#include "apps/progress.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/core/machine.hpp"
#include "fbvins/experiment/bench_runner.hpp"
#include "fbvins/experiment/bench_tables.hpp"
#include "fbvins/report/report.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(MATRIX lists recordings, frontends, configurations and repetitions; every combination, a cell, is run, several at a time.
After an interruption the same command continues: finished cells are not run again, unless program or configuration
have changed. Writes results.csv, results.json (machine, version, effective configurations), tables.md and report.html.

examples:
  fbvins bench configs/table1.yaml --euroc ~/euroc            the paper's Table 1, from real EuRoC
  fbvins bench configs/table1.yaml --inputs flights           the same flights with rendered images (NAME/imu0.csv, groundtruth.csv)
  fbvins bench configs/scenarios.yaml --jobs 4 --out scenarios --discard-rendered
  fbvins bench configs/scenarios.yaml --out new --reference scenarios/results.csv      exit code 1 where it got worse
  fbvins bench configs/scenarios.yaml --list                  names of the cells, one a line
  fbvins bench configs/scenarios.yaml --out new --cell fast-8s-s3-klt     one cell alone, on any machine that shares the folder;
                                                              then without --cell, when all are done, to write the tables
)";

struct Arguments {
  std::string matrix, out, reference, cell;
  PlanOptions where;
  BenchOptions bench;
  Tolerance tolerance;
  bool list = false, quiet = false;
};

Result<void> write_all(const Arguments& a, const std::string& title, const std::vector<CellResult>& results,
                       const nlohmann::ordered_json& payload) {
  const std::string provenance = fmt::format("fbvins {} on {}\n\n", FBVINS_VERSION, describe_machine());
  return write_files(a.out, {{"results.csv", results_csv(results)},
                             {"results.json", results_json(title, results).dump(1) + "\n"},
                             {"tables.md", provenance + markdown(payload)},
                             {"report.html", report_html({}, payload, {.title = title})}});
}

int list_cells(const Plan& plan) {
  for (const Cell& cell : plan.cells) fmt::print("{}\n", cell.id);
  return kOk;
}

int bench_cell(const Plan& plan, const Arguments& a) {
  const Result<BenchOutcome> outcome = run_cell(plan, a.bench, a.cell);
  if (!outcome) return fail(outcome.error().message);
  for (const std::string& problem : outcome->failed) warn(problem);
  if (!outcome->failed.empty()) return kEstimationFailed;
  if (!a.quiet) fmt::print("{}: {}\n", a.cell, outcome->run > 0 ? "done" : "was done before");
  return kOk;
}

int bench(Arguments a) {
  const Result<Matrix> matrix = read_matrix(a.matrix);
  if (!matrix) return fail(matrix.error().message);
  if (a.out.empty()) a.out = "out/bench-" + std::filesystem::path(a.matrix).stem().string();
  if (a.where.rendered.empty()) a.where.rendered = a.out + "/rendered";
  if (a.where.inputs.empty()) a.where.inputs = std::filesystem::path(a.matrix).parent_path().string();
  const Result<Plan> plan = make_plan(*matrix, a.where);
  if (!plan) return fail(plan.error().message);
  if (a.list) return list_cells(*plan);
  a.bench.out = a.out;
  a.bench.program = program_folder() / "fbvins";
  if (!a.cell.empty()) return bench_cell(*plan, a);
  std::map<std::string, Reference> reference;
  if (!a.reference.empty()) {
    Result<std::map<std::string, Reference>> read = read_reference(a.reference);
    if (!read) return fail(read.error().message);
    reference = *std::move(read);
  }

  const Result<BenchOutcome> outcome = [&] {
    const ProgressBar bar(a.quiet);
    return run_plan(*plan, a.bench, [&](const BenchStep& step) {
      bar.draw(step.share, fmt::format("{:3.0f} %  {}/{} cells  {}  {}", 100 * step.share, step.cells_done, step.cells,
                                       step.share > 0.01 ? bar.left(step.share, 1 - step.share) : "", step.now));
    });
  }();
  if (!outcome) return fail(outcome.error().message);
  for (const std::string& problem : outcome->failed) warn(problem);

  const std::vector<CellResult> results = read_results(*plan, a.out);
  const std::vector<Regression> worse = regressions(results, reference, a.tolerance);
  const nlohmann::ordered_json payload = bench_payload(matrix->title, results, worse);
  if (Result<void> written = write_all(a, matrix->title, results, payload); !written) return fail(written.error().message);
  if (!a.quiet)
    fmt::print("{}{} cells run, {} kept from before, {} failed; results in {}\n", markdown(payload), outcome->run,
               outcome->reused, outcome->failed.size(), bold(a.out));
  if (!worse.empty()) warn(fmt::format("{} figures are worse than the reference", worse.size()));
  return outcome->failed.empty() && worse.empty() ? kOk : kEstimationFailed;
}

}  // namespace

void add_bench_command(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  a->bench.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  CLI::App* command = program.add_subcommand("bench", kBenchDescription);
  command->footer(kExamples);
  command->add_option("MATRIX", a->matrix, "YAML file")->required();
  command->add_option("--out", a->out, "folder for the results (default out/bench-<matrix>)");
  command->add_option("--jobs", a->bench.jobs, "processes at a time")->check(CLI::Range(1, 1024))->capture_default_str();
  command->add_option("--euroc", a->where.euroc, "folder with the EuRoC recordings that the matrix names");
  command->add_option("--inputs", a->where.inputs,
                      "folder with recorded flights to render along (default: the matrix file's folder)");
  command->add_option("--rendered", a->where.rendered,
                      "folder for rendered recordings (default OUT/rendered); those in it are reused");
  CLI::Option* discard = command->add_flag("--discard-rendered", a->bench.discard_rendered,
                                           "delete each rendered recording as soon as its cells are done");
  CLI::Option* reference = command->add_option("--reference", a->reference, "results.csv of an earlier run to compare with");
  command->add_option("--tolerance", a->tolerance.share, "share by which an error may grow against the reference")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  CLI::Option* list = command->add_flag("--list", a->list, "run nothing, print the names of all cells, one a line");
  command->add_option("--cell", a->cell, "run this cell alone; any number of processes may share OUT, each cell is run once")
      ->excludes(list)
      ->excludes(discard)
      ->excludes(reference);
  command->add_flag("--quiet", a->quiet, "print nothing but errors and warnings");
  command->callback([a, &exit_code] { exit_code = bench(*a); });
}

}  // namespace fbvins::app
