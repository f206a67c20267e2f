// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/config_arguments.hpp"
#include "apps/terminal.hpp"
#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/option_tiers.hpp"
#include "fbvins/config/yaml.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kConfigExamples = R"(examples:
  fbvins config                                  the options for users with unit, range, value and meaning
  fbvins config --all                            those for experts as well
  fbvins config --yaml > drone.yaml              a file to start from
  fbvins config --profile a55 --yaml             what a profile sets
  fbvins config --config drone.yaml --set estimator.max_iterations=8
)";

struct ShowArguments {
  ConfigArguments config;
  bool all = false, yaml = false;
};

void print_table(const std::vector<OptionField>& fields) {
  for (const OptionField& field : fields) {
    if (field.is_group()) {
      fmt::print("\n{}: {}\n", bold(field.path), field.meaning);
      continue;
    }
    const std::string range = field.range_text();
    fmt::print("  {} = {}{}{}{}\n      {}\n", field.path, field.value_text(), field.unit.empty() ? "" : " ", field.unit,
               range.empty() ? "" : "   " + range, field.meaning);
  }
}

int show(const ShowArguments& arguments) {
  auto config = arguments.config.load();
  if (!config) return fail(config.error().message);
  std::vector<OptionField> fields = fields_of(*config);
  if (!arguments.all) fields = user_fields(fields);
  if (arguments.yaml) fmt::print("{}", write_yaml(fields));
  else print_table(fields);
  return kOk;
}

}  // namespace

void add_config_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<ShowArguments>();
  CLI::App* command = program.add_subcommand("config", "print options with value, unit, range and meaning");
  command->footer(kConfigExamples);
  arguments->config.add_to(*command);
  command->add_flag("--all", arguments->all, "options for experts as well as those for users");
  command->add_flag("--yaml", arguments->yaml, "as a configuration file");
  command->callback([arguments, &exit_code] { exit_code = show(*arguments); });
}

}  // namespace fbvins::app
