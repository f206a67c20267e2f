// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "apps/commands.hpp"
#include "apps/simulated_boards.hpp"

namespace fbvins::app {

void add_simulate_board_command(CLI::App& simulate, int&) { simulate.add_subcommand("board", kSimulateBoardDescription); }

Result<std::string> hang_simulated_tags(World&, const Simulation&, int) {
  return Error{ErrorCode::invalid_argument, "fbvins-lab hangs tags, this program does not"};
}

}  // namespace fbvins::app
