// SPDX-License-Identifier: Apache-2.0
// Works through a plan with several processes of the program itself. What is finished stays finished: a run that was
// killed goes on where it was, and a cell is run again only when program, arguments or configuration changed.
// One thread.
//
//   Result<BenchOutcome> outcome = run_plan(*plan, {.program = "/usr/bin/fbvins", .out = "bench", .jobs = 4}, show);
//
// Folders: OUT/cells/ID of each cell (as `fbvins run` writes it, and cell.json), OUT/logs; recordings that are drawn
// lie where the plan says. A folder appears under its name only when it is complete.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/experiment/matrix.hpp"

namespace fbvins {

struct BenchOptions {
  std::string program = "";  ///< fbvins
  std::string out = "";
  int jobs = 1;
  bool discard_drawn = false;  ///< delete what was drawn once its cells are done
};

/// How far it is; drawing weighs more than estimating.
struct BenchStep {
  double share = 0;  ///< of the work of this session, 0 to 1
  int cells_done = 0, cells = 0;
  std::string now;  ///< what was started or ended last
};

struct BenchOutcome {
  int run = 0, reused = 0;
  std::vector<std::string> failed;  ///< "ID: why", with the log's last line
};

Result<BenchOutcome> run_plan(const Plan& plan, const BenchOptions& options, const std::function<void(const BenchStep&)>& show);

/// Folder of a cell's results.
std::string cell_folder(const std::string& out, const Cell& cell);

}  // namespace fbvins
