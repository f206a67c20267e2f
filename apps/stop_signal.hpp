// SPDX-License-Identifier: Apache-2.0
// Ctrl-C, the stop of a service, or a terminal that hangs up ends a live run regularly.
//
//   const StopSignals signals;                              // first thing, before other threads are made
//   const StopSignal stop([&] { source.stop(); });          // for as long as there is something to stop
#pragma once

#include <functional>
#include <thread>

namespace fbvins::app {

/// While it exists, SIGINT, SIGTERM and SIGHUP are noted instead of ending the program, and SIGPIPE is an error of the write. One
/// in a process.
///
/// These are handlers, not blocked signals: a library may have made threads before main() that block nothing, and the
/// kernel would end the program through one of them. Still, the signals are blocked in this thread and in all that it makes, so
/// that their system calls are not interrupted; a thread of its own takes them. A SIGINT or SIGTERM half a second after the first
/// signal ends the program at once.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  std::thread taker_;
};

/// Whether a signal has come. From any thread.
bool stop_is_wanted();

/// While it exists, a stop signal calls `on_stop`, once, on a thread of its own; at once if one has come before.
class StopSignal {
 public:
  explicit StopSignal(std::function<void()> on_stop);
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
};

}  // namespace fbvins::app
