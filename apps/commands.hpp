// SPDX-License-Identifier: Apache-2.0
// The subcommands of `fbvins`. Each adds itself to the command line and, when chosen, sets exit_code.
#pragma once

#include <CLI/CLI.hpp>

namespace fbvins::app {

/// What the program tells the shell.
enum ExitCode : int {
  kOk = 0,
  kEstimationFailed = 1,  ///< the input was fine, but no pose came out of it
  kBadInput = 2,          ///< wrong usage, unreadable file, nothing to compare
};

void add_run_command(CLI::App& program, int& exit_code);
void add_eval_command(CLI::App& program, int& exit_code);
void add_info_command(CLI::App& program, int& exit_code);
void add_config_command(CLI::App& program, int& exit_code);
void add_simulate_command(CLI::App& program, int& exit_code);
void add_report_command(CLI::App& program, int& exit_code);
void add_bench_command(CLI::App& program, int& exit_code);
void add_live_command(CLI::App& program, int& exit_code);
void add_map_command(CLI::App& program, int& exit_code);
void add_vocab_command(CLI::App& program, int& exit_code);

}  // namespace fbvins::app
