// SPDX-License-Identifier: Apache-2.0
// Runs a plan with several processes of the program itself, or a single cell of it. Finished results are kept: a bench that was
// killed continues, and a cell is run again only if program, arguments or configuration changed. One thread; run_cell() may run
// in any number of processes, on any number of machines that share the folder.
//
//   Result<BenchOutcome> outcome = run_plan(*plan, {.program = "/usr/bin/fbvins", .out = "bench", .jobs = 4}, show);
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/experiment/bench_folder.hpp"

namespace fbvins {

/// Progress; rendering has more weight than estimating.
struct BenchStep {
  double share = 0;  ///< share of the work of this call, 0 to 1
  int cells_done = 0, cells = 0;
  std::string now;  ///< the last job that started or ended
};

struct BenchOutcome {
  int run = 0, reused = 0;
  std::vector<std::string> failed = {};  ///< "ID: reason", with the log's last line
};

/// An error if another process works in the folder.
Result<BenchOutcome> run_plan(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show);

/// Runs one cell, and first renders its recording if it does not exist. A process that comes second to a cell or a recording
/// waits for the first, and reuses its result, or makes it if the first one failed. An unknown cell and a run_plan() at work in
/// the folder are errors.
Result<BenchOutcome> run_cell(const Plan& plan, const BenchOptions& options, const std::string& id);

}  // namespace fbvins
