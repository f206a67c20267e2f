// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/live/parameter_reader.hpp"
#include "fbvins/mavlink/px4_parameters.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(For PX4 v1.14 and later, indoors without GPS and compass unless options say otherwise; docs/px4.md explains each parameter.

examples:
  fbvins px4 params -o vision.params                   to load in QGroundControl: Parameters, Tools, Load from file
  fbvins px4 params --link serial
  fbvins px4 check udp:127.0.0.1:14580                 reads them from the vehicle, and says what is wrong
  fbvins px4 check serial:/dev/ttyS1:921600 --link serial

exit codes of check: 0 all is right, 1 something is wrong, 2 wrong usage, or no flight controller is heard
)";

struct Arguments {
  Px4VisionSetup setup;
  std::string link = "none", output, address;
  bool json = false;

  Px4VisionSetup made() const {
    Px4VisionSetup out = setup;
    out.link = link == "serial" ? Px4Link::serial : link == "ethernet" ? Px4Link::ethernet : Px4Link::none;
    return out;
  }
};

int print_parameters(const Arguments& arguments) {
  const std::string text = px4_parameter_file(arguments.made());
  if (arguments.output.empty()) {
    fmt::print("{}", text);
    return kOk;
  }
  if (Result<void> done = write_file_atomically(arguments.output, text); !done) return fail(done.error().message);
  return kOk;
}

int check(const Arguments& arguments) {
  const Px4VisionSetup setup = arguments.made();
  const auto values = read_parameters(arguments.address, px4_parameter_names(setup), {.system_id = arguments.setup.system_id});
  if (!values) return fail(values.error().message);
  if (values->empty()) return fail(arguments.address + ": the flight controller answers no request for a parameter");
  const std::vector<Px4Finding> found = judge_px4(setup, *values);
  bool wrong = false;
  Json json = Json::array();
  for (const Px4Finding& finding : found) {
    wrong |= finding.wrong;
    json.push_back({{"name", finding.name}, {"wrong", finding.wrong}, {"sentence", finding.sentence}});
    if (!arguments.json) fmt::print("{}{}\n", finding.wrong ? "" : "note: ", finding.sentence);
  }
  if (arguments.json) fmt::print("{}\n", Json{{"read", values->size()}, {"findings", json}}.dump(2));
  return wrong ? kSensorsWrong : kOk;
}

}  // namespace

void add_px4_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("px4", kPx4Description);
  command->footer(kExamples);
  command->require_subcommand(1);
  const auto add = [&](const char* name, const char* about) {
    CLI::App* sub = command->add_subcommand(name, about);
    sub->footer(kExamples);
    sub->add_flag("--gps", arguments->setup.gps, "GPS is fused beside vision");
    sub->add_flag("--compass", arguments->setup.compass, "the vehicle has a compass, and it is used");
    sub->add_flag("--barometer,!--no-barometer", arguments->setup.barometer,
                  "the barometer is fused beside vision's height, for when vision fails; fused by default");
    sub->add_option("--link", arguments->link, "how the vehicle is connected: its port's parameters, too")
        ->check(CLI::IsMember({"none", "serial", "ethernet"}))
        ->capture_default_str();
    sub->add_option("--system-id", arguments->setup.system_id, "live.mavlink.system_id")
        ->check(CLI::Range(1, 255))
        ->capture_default_str();
    return sub;
  };
  CLI::App* params = add("params", "print a file of parameters to load");
  params->add_option("-o,--output", arguments->output, "the file to write");
  params->callback([arguments, &exit_code] { exit_code = print_parameters(*arguments); });
  CLI::App* checking = add("check", "read a vehicle's parameters and say what is wrong");
  checking->add_option("ADDRESS", arguments->address, "udp:HOST:PORT[:OWN_PORT] or serial:DEVICE:BAUD, as for --mavlink")
      ->required();
  checking->add_flag("--json", arguments->json, "print JSON");
  checking->callback([arguments, &exit_code] { exit_code = check(*arguments); });
}

}  // namespace fbvins::app
