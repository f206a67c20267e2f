// SPDX-License-Identifier: Apache-2.0
// Ctrl-C, or the stop of a service, ends a live run regularly.
#pragma once

#include <functional>
#include <stop_token>
#include <thread>

namespace fbvins::app {

/// While it exists, SIGINT and SIGTERM call `on_stop` (once, on a thread of its own) instead of ending the program. Needs the
/// signals blocked in all threads: call block_stop_signals() before any is started.
class StopSignal {
 public:
  explicit StopSignal(std::function<void()> on_stop);

 private:
  std::jthread thread_;
};

/// Blocks both signals in this thread and all that it starts.
void block_stop_signals();
/// Whether a signal is pending that no StopSignal has taken.
bool stop_is_wanted();

}  // namespace fbvins::app
