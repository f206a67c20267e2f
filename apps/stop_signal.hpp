// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and a service's stop end a live run in good order.
#pragma once

#include <functional>
#include <stop_token>
#include <thread>

namespace fbvins::app {

/// While it lives, SIGINT and SIGTERM call `on_stop` (once, on a thread of its own) instead of ending the program. To be made
/// before other threads that must not be interrupted; those inherit that the signals are blocked.
class StopSignal {
 public:
  explicit StopSignal(std::function<void()> on_stop);

 private:
  std::jthread thread_;
};

/// Blocks both signals in this thread and all that it starts.
void block_stop_signals();
/// Whether one has come since, which no StopSignal has seen.
bool stop_is_wanted();

}  // namespace fbvins::app
