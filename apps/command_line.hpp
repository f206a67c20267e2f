// SPDX-License-Identifier: Apache-2.0
// One command line, several programs: `fbvins` holds the commands that read a recording and write results, and hands the
// others to the program beside it that holds them. The user types `fbvins live` all the same, and a build of `fbvins` alone
// compiles no more than it runs.
#pragma once

#include <initializer_list>

#include "apps/commands.hpp"

namespace fbvins::app {

using AddCommand = void (*)(CLI::App& program, int& exit_code);

/// A command that another program holds: a program in the same folder.
struct HandedOver {
  const char* command;
  const char* description;  ///< as in that program
  const char* program;
};

/// Becomes the program that holds the command; returns, with an error, only where that is not there.
int hand_over(const HandedOver& command, char** argv);

/// What main() of each program does: parses, runs the command, returns the exit code.
int run_command_line(int argc, char** argv, std::initializer_list<AddCommand> commands,
                     std::initializer_list<HandedOver> elsewhere = {});

}  // namespace fbvins::app
