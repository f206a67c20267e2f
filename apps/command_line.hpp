// SPDX-License-Identifier: Apache-2.0
// One command line, several programs: `fbvins` has the commands that read a recording and write results, and starts the
// program beside it for the others. The user types `fbvins live` all the same, and a build of `fbvins` alone need not
// compile the rest.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

#include "apps/commands.hpp"

namespace fbvins::app {

using AddCommand = void (*)(CLI::App& program, int& exit_code);

/// A command of another program in the same folder.
struct HandedOver {
  const char* command;
  const char* description;  ///< as in that program
  const char* program;
};

/// Where the running program is, without symbolic links; also where /proc is not mounted.
std::filesystem::path program_folder();

/// Replaces this process by the program that has the command; returns, with an error, only if that cannot be started.
int hand_over(const HandedOver& command, char** argv);

/// Version, commit, compiler and features: the text of --version.
std::string about_this_build();

/// The main() of each program: parses, runs the command, returns the exit code.
int run_command_line(int argc, char** argv, std::initializer_list<AddCommand> commands,
                     std::initializer_list<HandedOver> elsewhere = {});

}  // namespace fbvins::app
