// SPDX-License-Identifier: Apache-2.0
// The `fbvins` program: it runs recordings, simulates and reports, and hands other commands to the programs beside it. One file
// for each subcommand, exit codes in commands.hpp.
#include "apps/command_line.hpp"
#include "apps/open_recording.hpp"

int main(int argc, char** argv) {
  using namespace fbvins::app;
  constexpr const char* kBags = "fbvins-bags";
  if (is_for_bags(argc, argv)) return hand_over({argv[1], "", kBags}, argv);
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
