// SPDX-License-Identifier: Apache-2.0
#include "apps/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "apps/terminal.hpp"

namespace fbvins::app {
namespace {

constexpr int kBarWidth = 30;
constexpr double kRedraw_s = 0.1;

std::string clock_text(double seconds) {
  const int s = static_cast<int>(seconds + 0.5);
  return s < 60 ? fmt::format("{} s", s) : fmt::format("{}:{:02} min", s / 60, s % 60);
}

}  // namespace

Progress::Progress(int total, bool quiet)
    : total_(std::max(total, 1)), quiet_(quiet), terminal_(stderr_is_terminal()), start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (!quiet_ && terminal_) tell("\r\033[K");
}

double Progress::elapsed_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

std::string Progress::describe(int done, double elapsed) const {
  const double rate = elapsed > 0 ? (done - begun_at_) / elapsed : 0;
  const std::string left = rate > 0 ? clock_text((total_ - done) / rate) + " left" : "";
  return fmt::format("{:3} %  {}/{} frames  {:.0f}/s  {}", 100LL * done / total_, done, total_, rate, left);
}

void Progress::update(int done) {
  if (quiet_) return;
  done = std::min(done, total_);
  const double elapsed = elapsed_s();
  if (terminal_) {
    if (elapsed - last_drawn_s_ < kRedraw_s && done < total_) return;
    last_drawn_s_ = elapsed;
    const int filled = static_cast<int>(static_cast<long long>(kBarWidth) * done / total_);
    tell(fmt::format("\r\033[K[{:#>{}}{:.>{}}] {}", "", filled, "", kBarWidth - filled, describe(done, elapsed)));
    return;
  }
  const int tenth = static_cast<int>(10LL * done / total_);
  if (tenth == last_tenth_) return;
  last_tenth_ = tenth;
  tell(describe(done, elapsed) + "\n");
}

}  // namespace fbvins::app
