// SPDX-License-Identifier: Apache-2.0
// What a bench keeps on disk, and the work that makes it: recordings to render, cells to run. A folder has its name only when it
// is complete. One thread; several processes may share a folder where each job is locked.
//
//   const BenchFolder folder(plan, {.program = "/usr/bin/fbvins", .out = "bench"});
//   const BenchJob job = folder.run(plan.cells[0]);
//   if (!folder.is_done(job)) ...                    // clear(job), run job.command, finish(job, exit code)
//
// OUT/cells/ID of each cell (as `fbvins run` writes it, and cell.json), OUT/logs, OUT/locks; recordings lie where the plan says.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/experiment/matrix.hpp"

namespace fbvins {

struct BenchOptions {
  std::string program = "";  ///< fbvins
  std::string out = "";
  int jobs = 1;
  bool discard_rendered = false;  ///< delete what was rendered once its cells are done
};

/// One run of the program, which writes a folder.
struct BenchJob {
  bool renders = false;  ///< a recording, not a cell
  std::string name;
  std::vector<std::string> command;  ///< writes to `part`
  std::string folder, part;          ///< of the result; until it is complete
  std::string log, lock;             ///< files
  std::string made_of;               ///< what the result depends on
};

class BenchFolder {
 public:
  BenchFolder(const Plan& plan, const BenchOptions& options);

  Result<void> make() const;
  /// Of a recording that is rendered.
  BenchJob render(const Recording& recording) const;
  BenchJob run(const Cell& cell) const;
  /// Its result is there, and made of the same.
  bool is_done(const BenchJob& job) const;
  /// Nothing to render, or rendered.
  bool is_there(const Recording& recording) const { return !recording.rendered || is_done(render(recording)); }
  /// Removes what an earlier try left.
  static void clear(const BenchJob& job);
  /// After the program's end: true when the result is there under its name.
  static Result<bool> finish(const BenchJob& job, int exit_code);
  /// "ID: exit code 3: ", and the last line that the program said.
  static std::string failure(const BenchJob& job, int exit_code);
  /// Held by one bench alone, or by any number of processes that do single cells.
  std::string lock() const { return options_.out + "/lock"; }

 private:
  const Plan& plan_;
  const BenchOptions& options_;
  std::uint64_t program_hash_;
};

/// Folder of a cell's results.
std::string cell_folder(const std::string& out, const Cell& cell);

}  // namespace fbvins
