// SPDX-License-Identifier: Apache-2.0
// fbvins-calibrate, to which `fbvins` hands what makes a calibration: boards to print, and the calibration from them.
#include "apps/command_line.hpp"

int main(int argc, char** argv) {
  using namespace fbvins::app;
  return run_command_line(argc, argv, {add_calibrate_command, add_target_command});
}
