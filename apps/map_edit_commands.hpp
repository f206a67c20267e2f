// SPDX-License-Identifier: Apache-2.0
// Private to `fbvins map`: its subcommands that change maps or compare them.
#pragma once

namespace CLI {
class App;
}

namespace fbvins::app {

/// cut, rename, align, diff.
void add_map_edits(CLI::App& map, int& exit_code);

}  // namespace fbvins::app
