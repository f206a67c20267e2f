// SPDX-License-Identifier: Apache-2.0
// A program beside this one that reads a device by its maker's library (examples/*_bridge.py), started, watched and ended here.
//
//   BridgeProcess bridge({.name = "oak", .arguments = {"python3", script, socket}, .packages = "depthai numpy"}, say, on_end);
//   bridge.something_came();                     // from now on it is started again when it fails
//   if (bridge.is_over()) return bridge.end();   // why, in one sentence
#pragma once

#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins::app {

struct BridgeCommand {
  std::string name;                    ///< of the source, begins each sentence
  std::vector<std::string> arguments;  ///< interpreter, script, its arguments
  std::string packages;                ///< that `pip install` must have installed
  std::string own_path = "";           ///< lines with it are of the connection, which the source reports itself
};

/// What such a program writes, as sentences: of a traceback the last line, which says what was wrong.
class BridgeWords {
 public:
  explicit BridgeWords(const BridgeCommand& command) : command_(command) {}
  /// One line. The sentence before it, if there is one to be said; a sentence waits for the next line, as the last one is the
  /// reason of an end.
  std::string add(std::string_view line);
  /// The sentence that waits.
  std::string take();
  /// Why the program has ended, if it ends now: what to install where that is missing, else its last words.
  std::string reason() const;

 private:
  const BridgeCommand& command_;
  bool in_traceback_ = false;
  std::string waiting_, failure_, last_;
};

class BridgeProcess {
 public:
  using Say = std::function<void(const std::string&)>;
  /// `on_end` is called once, on a thread of its own, when the program has ended for good.
  BridgeProcess(BridgeCommand command, Say say, std::function<void()> on_end);
  /// Ends it: SIGTERM, and after two seconds SIGKILL.
  ~BridgeProcess();
  BridgeProcess(const BridgeProcess&) = delete;
  BridgeProcess& operator=(const BridgeProcess&) = delete;

  /// It has sent data: a later failure is not that of its installation, and it is started again.
  void something_came() { came_ = true; }
  bool is_over() const { return over_; }
  /// After is_over(): the end of its data (exit code 0 after something came), or what went wrong.
  Result<void> end() const;
  /// Waits until it is over, `longest_s` at most.
  void wait_for_end(double longest_s);

 private:
  void watch();
  bool run_once(Result<void>& ended);
  pid_t start(int output) const;
  bool is_dead(int& status) const;
  void terminate(int& status) const;

  BridgeCommand command_;
  Say say_;
  std::function<void()> on_end_;
  std::atomic<bool> came_ = false, over_ = false, stopping_ = false;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Result<void> end_;
  pid_t child_ = -1;  ///< of the watching thread alone
  std::thread watcher_;
};

}  // namespace fbvins::app
