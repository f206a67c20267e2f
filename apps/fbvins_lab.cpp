// SPDX-License-Identifier: Apache-2.0
// fbvins-lab, to which `fbvins` hands experiments.
#include "apps/command_line.hpp"

int main(int argc, char** argv) { return fbvins::app::run_command_line(argc, argv, {fbvins::app::add_bench_command}); }
