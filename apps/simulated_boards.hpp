// SPDX-License-Identifier: Apache-2.0
// Boards and tags in `fbvins simulate`: in fbvins-lab command_simulate_board.cpp, in `fbvins`, which hands them over,
// no_simulated_boards.cpp.
#pragma once

#include <string>

#include "fbvins/sim/simulation.hpp"

namespace CLI {
class App;
}

namespace fbvins::app {

/// Below `simulate`.
void add_simulate_board_command(CLI::App& simulate, int& exit_code);

/// Hangs tags of 0.2 m on walls that the flight sees; their places as tags.yaml.
Result<std::string> hang_simulated_tags(World& world, const Simulation& simulation, int count);

}  // namespace fbvins::app
