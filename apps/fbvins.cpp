// SPDX-License-Identifier: Apache-2.0
// The `fbvins` program: it runs recordings, simulates and reports, and hands other commands to the programs beside it. One file
// for each subcommand, exit codes in commands.hpp.
#include <algorithm>
#include <span>
#include <string_view>

#include "apps/command_line.hpp"
#include "apps/open_recording.hpp"

namespace {

/// Of a command that another program has with boards and tags as well: whether it is asked for them, by `what` or `what=VALUE`.
bool wants(std::string_view command, std::string_view what, std::span<char*> arguments) {
  if (arguments.size() < 3 || arguments[1] != command) return false;
  return std::ranges::any_of(arguments.subspan(2), [&](std::string_view argument) {
    return argument.starts_with(what) && (argument.size() == what.size() || argument[what.size()] == '=');
  });
}

}  // namespace

int main(int argc, char** argv) {
  using namespace fbvins::app;
  constexpr const char* kBags = "fbvins-bags";
  if (is_for_bags(argc, argv)) return hand_over({argv[1], "", kBags}, argv);
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  if (wants("run", "--tags", arguments)) return hand_over({argv[1], "", "fbvins-tools"}, argv);
#ifdef FBVINS_WITH_LAB
  if (wants("simulate", "--tags", arguments) ||
      wants("simulate", "board", arguments.first(std::min<std::size_t>(arguments.size(), 3))))
    return hand_over({argv[1], "", "fbvins-lab"}, argv);
#endif
  return run_command_line(argc, argv,
                          {add_run_command, add_config_command,
#ifdef FBVINS_WITH_LAB
                           add_simulate_command, add_report_command
#endif
                          },
                          {
                              {"calibrate", kCalibrateDescription, "fbvins-calibrate"},
                              {"target", kTargetDescription, "fbvins-calibrate"},
                              {"convert", kConvertDescription, kBags},
                              {"live", kLiveDescription, "fbvins-live"},
                              {"view", kViewDescription, "fbvins-live"},
                              {"eval", kEvalDescription, "fbvins-tools"},
                              {"doctor", kDoctorDescription, "fbvins-tools"},
                              {"bug-report", kBugReportDescription, kBags},
                              {"info", kInfoDescription, "fbvins-tools"},
                              {"map", kMapDescription, "fbvins-tools"},
                              {"mocap", kMocapDescription, "fbvins-tools"},
                              {"px4", kPx4Description, "fbvins-live"},
                              {"record", kRecordDescription, "fbvins-tools"},
                              {"vocab", kVocabDescription, "fbvins-tools"},
#ifdef FBVINS_WITH_LAB
                              {"fly", kFlyDescription, "fbvins-lab"},
                              {"bench", kBenchDescription, "fbvins-lab"},
                              {"tune", kTuneDescription, "fbvins-lab"},
#endif
                          });
}
