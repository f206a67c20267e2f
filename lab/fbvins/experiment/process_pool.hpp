// SPDX-License-Identifier: Apache-2.0
// Runs programs in parallel as child processes, which end with their parent. One thread.
//
//   ProcessPool pool;
//   pool.start(1, {"/usr/bin/fbvins", "run", "flight"}, "log.txt");
//   ProcessPool::Ended ended = pool.wait();          // ended.tag == 1
#pragma once

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

class ProcessPool {
 public:
  struct Ended {
    int tag = 0;
    int exit_code = 0;  ///< 128 + signal if a signal ended it
  };
  ProcessPool() = default;
  /// Terminates and awaits programs that still run.
  ~ProcessPool();
  ProcessPool(const ProcessPool&) = delete;
  ProcessPool& operator=(const ProcessPool&) = delete;

  /// The program's stdout and stderr go to `log`.
  Result<void> start(int tag, const std::vector<std::string>& command, const std::string& log);
  int running() const { return static_cast<int>(tags_.size()); }
  /// Waits until one of them ends; at least one must be running.
  Ended wait();

 private:
  std::map<pid_t, int> tags_;
};

}  // namespace fbvins
