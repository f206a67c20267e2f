// SPDX-License-Identifier: Apache-2.0
// Programs run side by side, a few at a time. They die with their parent. One thread.
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
    int exit_code = 0;  ///< 128 + signal where a signal ended it
  };
  ProcessPool() = default;
  /// Ends what still runs.
  ~ProcessPool();
  ProcessPool(const ProcessPool&) = delete;
  ProcessPool& operator=(const ProcessPool&) = delete;

  /// What the program prints goes to `log`.
  Result<void> start(int tag, const std::vector<std::string>& command, const std::string& log);
  int running() const { return static_cast<int>(tags_.size()); }
  /// Until one of them ends; at least one must be running.
  Ended wait();

 private:
  std::map<pid_t, int> tags_;
};

}  // namespace fbvins
