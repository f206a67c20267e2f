// SPDX-License-Identifier: Apache-2.0
// `fbvins live --fault`: sensor faults for tests, where the laboratory is built in. Without it there is no such option.
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/source.hpp"

namespace CLI {
class App;
}

namespace fbvins::app {

void add_fault_option(CLI::App& command, std::vector<std::string>& faults);
/// `cameras`: of the rig.
Result<void> check_faults(const std::vector<std::string>& faults, int cameras);
/// Runs the source into `input`, with faults that check_faults() has found good.
Result<void> run_with_faults(Source& source, SensorInput& input, const std::vector<std::string>& faults);

}  // namespace fbvins::app
