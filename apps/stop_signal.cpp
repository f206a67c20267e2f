// SPDX-License-Identifier: Apache-2.0
#include "apps/stop_signal.hpp"

#include <csignal>
#include <ctime>
#include <utility>

namespace fbvins::app {
namespace {

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

void block_stop_signals() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

bool stop_is_wanted() {
  sigset_t pending;
  sigpending(&pending);
  return sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1;
}

StopSignal::StopSignal(std::function<void()> on_stop)
    : thread_([on_stop = std::move(on_stop)](const std::stop_token& ended) {
        const sigset_t set = stop_signals();
        const timespec look_again{.tv_sec = 0, .tv_nsec = 100'000'000};
        while (!ended.stop_requested())
          if (sigtimedwait(&set, nullptr, &look_again) > 0) return on_stop();
      }) {}

}  // namespace fbvins::app
