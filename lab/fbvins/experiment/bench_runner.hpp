// SPDX-License-Identifier: Apache-2.0
// Works through a plan with several processes of the program itself, or does a single cell of it. What is finished stays
// finished: a run that was killed goes on where it was, and a cell is run again only when program, arguments or configuration
// changed. One thread; run_cell() may be at work in any number of processes, on any number of machines that share the folder.
//
//   Result<BenchOutcome> outcome = run_plan(*plan, {.program = "/usr/bin/fbvins", .out = "bench", .jobs = 4}, show);
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/experiment/bench_folder.hpp"

namespace fbvins {

/// How far it is; rendering weighs more than estimating.
struct BenchStep {
  double share = 0;  ///< of the work of this session, 0 to 1
  int cells_done = 0, cells = 0;
  std::string now;  ///< what was started or ended last
};

struct BenchOutcome {
  int run = 0, reused = 0;
  std::vector<std::string> failed = {};  ///< "ID: why", with the log's last line
};

/// An error where another process works in the folder.
Result<BenchOutcome> run_plan(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show);

/// Does one cell, and renders its recording where that is not there. Who comes second to a cell or a recording waits for the
/// first, and finds it finished, or does it where the first one died. An unknown cell or a run_plan() at work in the folder is an
/// error.
Result<BenchOutcome> run_cell(const Plan& plan, const BenchOptions& options, const std::string& id);

}  // namespace fbvins
