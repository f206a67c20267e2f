// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"
#include "apps/web_page.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Shows a finished flight in the browser, on the page of `fbvins live --web`. It begins to play when the first viewer opens
the page, and can be moved back and forth. Ends at Ctrl-C.

examples:
  fbvins view flight.mcap                            a flight record of fbvins live --record
  fbvins view out/klt --recording MH_01_easy         a folder of fbvins run --out; its images are in the recording
  fbvins view out/klt --web 0.0.0.0:8080             for a phone: the printed address has a token
)";

struct Arguments {
  std::string flight, recording, web = "8080";
};

int run(const Arguments& arguments) {
  const StopSignals signals;
  const Result<void> shown = show_finished_flight(arguments.flight, arguments.recording, arguments.web);
  return shown ? kOk : fail(shown.error().message);
}

}  // namespace

void add_view_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("view", kViewDescription);
  command->footer(kExamples);
  command->add_option("flight", arguments->flight, "flight record, or folder of `fbvins run --out`")->required();
  command->add_option("--recording", arguments->recording, "recording with the images of a run");
  command->add_option("--web", arguments->web, kWebHelp)->capture_default_str();
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace fbvins::app
