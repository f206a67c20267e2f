// SPDX-License-Identifier: Apache-2.0
// A flight controller's program as a child: its output goes to a file, and it ends with us. One owner.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

struct ChildCommand {
  std::vector<std::string> words;        ///< the program's path, then its arguments
  std::vector<std::string> environment;  ///< NAME=VALUE; all that it gets
  std::string folder;                    ///< its working directory
  std::string log;                       ///< file for its output
};

/// The variables of this process but those whose names begin with `without`.
std::vector<std::string> environment_without(const std::string& without);

class ChildProcess {
 public:
  ChildProcess() = default;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Asks it to end, and kills it after three seconds.
  ~ChildProcess();

  Result<void> start(const ChildCommand& command);

 private:
  pid_t pid_ = -1;
};

}  // namespace fbvins
