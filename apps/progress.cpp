// SPDX-License-Identifier: Apache-2.0
#include "apps/progress.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/terminal.hpp"

namespace fbvins::app {
namespace {

constexpr int kBarWidth = 30;
constexpr double kRedraw_s = 0.1;

std::string clock_text(double seconds) {
  const int s = static_cast<int>(seconds + 0.5);
  return s < 60     ? fmt::format("{} s", s)
         : s < 3600 ? fmt::format("{}:{:02} min", s / 60, s % 60)
                    : fmt::format("{}:{:02} h", s / 3600, s / 60 % 60);
}

}  // namespace

ProgressBar::ProgressBar(bool quiet) : quiet_(quiet), terminal_(stderr_is_terminal()), start_(std::chrono::steady_clock::now()) {}

ProgressBar::~ProgressBar() {
  if (!quiet_ && terminal_) tell("\r\033[K");
}

double ProgressBar::elapsed_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

std::string ProgressBar::left(double done, double remains) const {
  return done > 0 && remains > 0 ? clock_text(elapsed_s() * remains / done) + " left" : "";
}

void ProgressBar::draw(double share, const std::string& text) const {
  if (quiet_) return;
  const int filled = static_cast<int>(kBarWidth * share);
  tell(terminal_ ? fmt::format("\r\033[K[{:#>{}}{:.>{}}] {}", "", filled, "", kBarWidth - filled, text) : text + "\n");
}

Progress::Progress(int total, bool quiet) : total_(std::max(total, 1)), bar_(quiet) {}

void Progress::draw(int done) const {
  const double elapsed = elapsed_s(), since = done - begun_at_;
  bar_.draw(static_cast<double>(done) / total_,
            fmt::format("{:3} %  {}/{} frames  {:.0f}/s  {}", 100LL * done / total_, done, total_,
                        elapsed > 0 ? since / elapsed : 0, bar_.left(since, total_ - done)));
}

void Progress::update(int done) {
  done = std::min(done, total_);
  const double elapsed = elapsed_s();
  const int tenth = static_cast<int>(10LL * done / total_);
  const bool due = bar_.on_terminal() ? elapsed - last_drawn_s_ >= kRedraw_s || done == total_ : tenth != last_tenth_;
  if (!due) return;
  last_drawn_s_ = elapsed, last_tenth_ = tenth;
  draw(done);
}

}  // namespace fbvins::app
