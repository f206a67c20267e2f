// SPDX-License-Identifier: Apache-2.0
// The `fbvins` program: recordings in, trajectories, figures and pages out. One file a subcommand, exit codes in commands.hpp.
#include "apps/command_line.hpp"

int main(int argc, char** argv) {
  using namespace fbvins::app;
  return run_command_line(
      argc, argv,
      {add_run_command, add_eval_command, add_info_command, add_config_command, add_map_command, add_vocab_command,
#ifdef FBVINS_WITH_LAB
       add_simulate_command, add_report_command
#endif
      },
      {
          {"live", kLiveDescription, "fbvins-live"},
#ifdef FBVINS_WITH_LAB
          {"fly", kFlyDescription, "fbvins-lab"},
          {"bench", kBenchDescription, "fbvins-lab"},
          {"mocap", kMocapDescription, "fbvins-lab"},
#endif
      });
}
