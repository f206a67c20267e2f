// SPDX-License-Identifier: Apache-2.0
#include "apps/command_line.hpp"

#include <fmt/format.h>
#include <sys/auxv.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "apps/terminal.hpp"

namespace fbvins::app {

/// Commit, compiler and features (cmake/BuildInfo.cmake).
extern const char* const kBuildInfo;

namespace {

constexpr const char* kExamples = R"(examples:
  fbvins run MH_01_easy                         estimate a flight, write out/MH_01_easy-boost
  fbvins run MH_01_easy.zip --frontend orb      another frontend, directly from the zip
  fbvins live --source replay:MH_01_easy        the same flight in wall time, poses at IMU rate
  fbvins eval MH_01_easy out/MH_01_easy-boost/trajectory_tum.txt
  fbvins report out/MH_01_easy-*                both runs in one page: report.html
  fbvins info MH_01_easy                        what is in a recording
  fbvins doctor MH_01_easy                      what is wrong with its setup
  fbvins config                                 options with unit, default, meaning

exit codes: 0 success, 1 no pose could be estimated (doctor, --check: something is wrong), 2 wrong usage or bad input
)";

}  // namespace

std::filesystem::path program_folder() {
  std::error_code error;
  std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) self = std::filesystem::canonical(reinterpret_cast<const char*>(getauxval(AT_EXECFN)), error);
  return self.parent_path();
}

int hand_over(const HandedOver& command, char** argv) {
  const std::string program = program_folder() / command.program;
  execv(program.c_str(), argv);
  return fail(fmt::format("the command {} is in a program of its own, {}, which cannot be started: {}; ./dev build makes it",
                          command.command, program, std::generic_category().message(errno)));
}

std::string about_this_build() { return fmt::format("fbvins {}\n{}", FBVINS_VERSION, kBuildInfo); }

int run_command_line(int argc, char** argv, std::initializer_list<AddCommand> commands,
                     std::initializer_list<HandedOver> elsewhere) {
  keep_standard_streams();
  CLI::App program{"FB-VINS: stereo visual-inertial odometry", "fbvins"};
  program.set_version_flag("--version", about_this_build(), "version, commit, compiler and features");
  program.footer(kExamples);
  program.require_subcommand(1);
  int exit_code = kOk;
  for (const AddCommand add : commands) add(program, exit_code);
  for (const HandedOver& other : elsewhere) {
    if (argc > 1 && argv[1] == std::string_view(other.command)) return hand_over(other, argv);
    program.add_subcommand(other.command, other.description);
  }
  try {
    if (argc <= 1) {
      std::fputs(program.help().c_str(), stderr);
      return kBadInput;
    }
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? kOk : kBadInput;  // --help and --version arrive here, too
  } catch (const std::exception& error) {               // such as no memory, or a full disk
    return fail(error.what());
  }
  return exit_code;
}

}  // namespace fbvins::app
