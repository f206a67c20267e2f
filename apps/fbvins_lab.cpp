// SPDX-License-Identifier: Apache-2.0
// fbvins-lab, to which `fbvins` hands flights and experiments.
#include "apps/command_line.hpp"

int main(int argc, char** argv) {
  using namespace fbvins::app;
  return run_command_line(argc, argv, {add_fly_command, add_bench_command, add_tune_command, add_simulate_command});
}
