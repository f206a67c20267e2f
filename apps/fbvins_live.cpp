// SPDX-License-Identifier: Apache-2.0
// fbvins-live, to which `fbvins` hands what runs in wall time.
#include "apps/command_line.hpp"

int main(int argc, char** argv) {
  return fbvins::app::run_command_line(
      argc, argv, {fbvins::app::add_live_command, fbvins::app::add_view_command, fbvins::app::add_px4_command});
}
