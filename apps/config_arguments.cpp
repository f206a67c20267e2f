// SPDX-License-Identifier: Apache-2.0
#include "apps/config_arguments.hpp"

#include <CLI/CLI.hpp>

#include "fbvins/frontend/frontend_options.hpp"

namespace fbvins::app {

void ConfigArguments::add_to(CLI::App& command) {
  command.add_option("--config", file, "YAML file that changes the defaults (see fbvins config)");
  command.add_option("--set", assignments, "one option, name=value; may be repeated")->take_all()->allow_extra_args(false);
  command.add_option("--frontend", frontend, "the frontend that tracks features")->check(CLI::IsMember(frontend_names()));
}

Result<Config> ConfigArguments::load() const {
  std::vector<std::string> all = assignments;
  if (!frontend.empty()) all.insert(all.begin(), "frontend.kind=" + frontend);
  return load_config(file, all);
}

}  // namespace fbvins::app
