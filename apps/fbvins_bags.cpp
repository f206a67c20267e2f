// SPDX-License-Identifier: Apache-2.0
// fbvins-bags, to which `fbvins` hands third-party recordings.
#include "apps/command_line.hpp"

int main(int argc, char** argv) {
  using namespace fbvins::app;
  return run_command_line(
      argc, argv,
      {add_run_command, add_doctor_command, add_eval_command, add_info_command, add_convert_command, add_bug_report_command});
}
