// SPDX-License-Identifier: Apache-2.0
// The `fbvins` program: one file a subcommand, exit codes in commands.hpp.
#include <cstdio>
#include <exception>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"

namespace {

constexpr const char* kExamples = R"(examples:
  fbvins run MH_01_easy                         estimate a flight, write out/MH_01_easy-klt
  fbvins run MH_01_easy.zip --frontend orb      the other frontend, straight from the zip
  fbvins live --source replay:MH_01_easy        the same flight in wall time, poses at IMU rate
  fbvins eval MH_01_easy out/MH_01_easy-klt/trajectory_tum.txt
  fbvins report out/MH_01_easy-*                both in one page: report.html
  fbvins info MH_01_easy                        what is in a recording
  fbvins config                                 options with unit, default, meaning

exit codes: 0 fine, 1 no pose could be estimated, 2 wrong usage or bad input
)";

}  // namespace

int main(int argc, char** argv) {
  using namespace fbvins::app;
  CLI::App program{"FB-VINS: stereo visual-inertial odometry", "fbvins"};
  program.set_version_flag("--version", "fbvins " FBVINS_VERSION);
  program.footer(kExamples);
  program.require_subcommand(1);
  int exit_code = kOk;
  add_run_command(program, exit_code);
  add_live_command(program, exit_code);
  add_eval_command(program, exit_code);
  add_info_command(program, exit_code);
  add_config_command(program, exit_code);
  add_map_command(program, exit_code);
  add_vocab_command(program, exit_code);
#ifdef FBVINS_WITH_LAB
  add_simulate_command(program, exit_code);
  add_report_command(program, exit_code);
  add_bench_command(program, exit_code);
#endif
  try {
    if (argc <= 1) {
      std::fputs(program.help().c_str(), stderr);
      return kBadInput;
    }
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? kOk : kBadInput;  // --help and --version arrive here, too
  } catch (const std::exception& error) {               // the last line of defence: no memory, a full disk
    return fail(error.what());
  }
  return exit_code;
}
