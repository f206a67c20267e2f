// SPDX-License-Identifier: Apache-2.0
// The files of a bench and the jobs that make them: recordings to render, cells to run. A job writes to a temporary folder, which
// is renamed when it is complete. One thread; several processes may share a folder, with a lock for each job.
//
//   const BenchFolder folder(plan, {.program = "/usr/bin/fbvins", .out = "bench"});
//   const BenchJob job = folder.run(plan.cells[0]);
//   if (!folder.is_done(job)) ...                    // clear(job), run job.command, finish(job, exit code)
//
// Layout: OUT/cells/ID for each cell (output of `fbvins run`, and cell.json), OUT/logs, OUT/locks; recordings as in the plan.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/experiment/matrix.hpp"

namespace fbvins {

struct BenchOptions {
  std::string program = "";  ///< path of fbvins
  std::string out = "";
  int jobs = 1;
  bool discard_rendered = false;  ///< delete a rendered recording once its cells are done
};

/// One run of the program, which writes a folder.
struct BenchJob {
  bool renders = false;  ///< a recording, not a cell
  std::string name;
  std::vector<std::string> command;  ///< writes to `part`
  std::string folder, part;          ///< of the complete result; of the incomplete one
  std::string log, lock;             ///< files
  std::string made_of;               ///< fingerprint of what the result depends on
};

class BenchFolder {
 public:
  BenchFolder(const Plan& plan, const BenchOptions& options);

  Result<void> make() const;
  /// The job of a recording with `rendered`.
  BenchJob render(const Recording& recording) const;
  BenchJob run(const Cell& cell) const;
  /// Whether its result exists with the same fingerprint.
  bool is_done(const BenchJob& job) const;
  /// Whether the recording exists: real, or rendered already.
  bool is_there(const Recording& recording) const { return !recording.rendered || is_done(render(recording)); }
  /// Removes an incomplete result.
  static void clear(const BenchJob& job);
  /// After the program's end: renames a complete result and returns true; false if the program failed.
  static Result<bool> finish(const BenchJob& job, int exit_code);
  /// "ID: exit code 3: " and the last line of the program's output.
  static std::string failure(const BenchJob& job, int exit_code);
  /// Lock file: exclusive for run_plan(), shared for run_cell().
  std::string lock() const { return options_.out + "/lock"; }

 private:
  const Plan& plan_;
  const BenchOptions& options_;
  std::uint64_t program_hash_;
};

/// Folder of a cell's results.
std::string cell_folder(const std::string& out, const Cell& cell);

}  // namespace fbvins
