// SPDX-License-Identifier: Apache-2.0
// fbvins-tools, to which `fbvins` hands commands on files: recordings and their setup, trajectories, maps, vocabularies, motion
// capture.
#include "apps/command_line.hpp"

int main(int argc, char** argv) {
  using namespace fbvins::app;
  return run_command_line(argc, argv,
                          {add_doctor_command, add_eval_command, add_info_command, add_map_command, add_mocap_command,
                           add_record_command, add_run_command, add_vocab_command});
}
