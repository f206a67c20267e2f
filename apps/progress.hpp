// SPDX-License-Identifier: Apache-2.0
// Progress of a long job: a bar with the time left on a terminal, a line every 10 % elsewhere.
// Writes to stderr only; the wall clock has no influence but on this display.
#pragma once

#include <chrono>
#include <string>

namespace fbvins::app {

/// The bar of any job.
class ProgressBar {
 public:
  /// quiet: say nothing at all.
  explicit ProgressBar(bool quiet);
  /// Removes the bar from the terminal.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  bool on_terminal() const { return terminal_; }
  /// `share` of the job, 0 to 1, with a text behind it; elsewhere than on a terminal the text alone.
  void draw(double share, const std::string& text) const;
  double elapsed_s() const;
  /// "5 s left" for what `remains` where `done` took the time until now; nothing where none of either is.
  std::string left(double done, double remains) const;

 private:
  bool quiet_, terminal_;
  std::chrono::steady_clock::time_point start_;
};

/// Of a job whose steps are frames.
class Progress {
 public:
  Progress(int total, bool quiet);

  void update(int done);
  /// So many steps were done before: the time left is that of the others.
  void begin_at(int done) { begun_at_ = done; }
  double elapsed_s() const { return bar_.elapsed_s(); }

 private:
  void draw(int done) const;

  int total_;
  ProgressBar bar_;
  double last_drawn_s_ = -1;
  int last_tenth_ = 0;
  int begun_at_ = 0;
};

}  // namespace fbvins::app
