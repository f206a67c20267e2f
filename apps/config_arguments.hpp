// SPDX-License-Identifier: Apache-2.0
// The arguments of commands that configure the odometry: --profile, --config, --frontend, --set.
#pragma once

#include <string>
#include <vector>

#include "fbvins/config/config_file.hpp"

namespace CLI {
class App;
}

namespace fbvins::app {

struct ConfigArguments {
  std::string file, frontend, profile;
  std::vector<std::string> assignments;

  void add_to(CLI::App& command);
  /// The profile's options, overridden by the file, by the frontend, then by the assignments.
  Result<Config> load() const;
};

}  // namespace fbvins::app
