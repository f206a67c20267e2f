// SPDX-License-Identifier: Apache-2.0
#include "apps/config_arguments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "fbvins/frontend/frontend_options.hpp"
#include "fbvins/frontend/frontend_registry.hpp"

namespace fbvins::app {
namespace {

void load_plugins(const std::vector<std::string>& plugins) {
  for (const std::string& plugin : plugins)
    if (Result<void> loaded = load_frontends(plugin); !loaded) throw CLI::ValidationError("--plugin", loaded.error().message);
}

/// The names that there are when it is asked, those of plugins included.
CLI::Validator name_of_frontend() {
  const auto check = [](std::string& name) { return CLI::IsMember(frontend_names())(name); };
  return {check, CLI::IsMember(frontend_names()).get_description(), "name of a frontend"};
}

}  // namespace

void ConfigArguments::add_to(CLI::App& command) {
  std::vector<std::string> names;
  std::string meanings;
  for (const Profile& one : profiles()) {
    names.emplace_back(one.name);
    meanings += fmt::format("; {}: {}", one.name, one.meaning);
  }
  command.add_option("--profile", profile, "options for a kind of computer, before those of --config" + meanings)
      ->check(CLI::IsMember(names));
  command.add_option("--config", file, "YAML file that changes the defaults (see fbvins config)");
  command.add_option("--set", assignments, "one option, name=value; may be repeated")->take_all()->allow_extra_args(false);
  // Before --frontend, to whose names it adds.
  command
      .add_option_function<std::vector<std::string>>("--plugin", load_plugins,
                                                     "shared library with frontends of your own (docs/cpp.md); may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command.add_option("--frontend", frontend, "the frontend that tracks features")->check(name_of_frontend());
}

Result<Config> ConfigArguments::load() const {
  std::vector<std::string> all = assignments;
  if (!frontend.empty()) all.insert(all.begin(), "frontend.kind=" + frontend);
  return load_config(file, all, profile);
}

}  // namespace fbvins::app
