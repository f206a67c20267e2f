// SPDX-License-Identifier: Apache-2.0
// Progress of a long job: a bar with the time left on a terminal, a line every 10 % elsewhere.
// Writes to stderr only; the wall clock has no influence but on this display.
#pragma once

#include <chrono>
#include <string>

namespace fbvins::app {

class Progress {
 public:
  /// total: number of steps; quiet: say nothing at all.
  Progress(int total, bool quiet);
  /// Removes the bar from the terminal.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(int done);
  /// So many steps were done before: the time left is that of the others.
  void begin_at(int done) { begun_at_ = done; }
  double elapsed_s() const;

 private:
  std::string describe(int done, double elapsed) const;

  int total_;
  bool quiet_, terminal_;
  std::chrono::steady_clock::time_point start_;
  double last_drawn_s_ = -1;
  int last_tenth_ = 0;
  int begun_at_ = 0;
};

}  // namespace fbvins::app
