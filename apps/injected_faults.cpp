// SPDX-License-Identifier: Apache-2.0
#include "apps/injected_faults.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#ifdef FBVINS_WITH_LAB
#include "fbvins/faults/sensor_faults.hpp"
#endif

namespace fbvins::app {

#ifdef FBVINS_WITH_LAB

void add_fault_option(CLI::App& command, std::vector<std::string>& faults) {
  command
      .add_option("--fault", faults,
                  "sensor fault to inject for tests, in seconds of the flight: KIND:START:LENGTH[:AMOUNT], as camera_off:8:2, "
                  "leap:12:1:0.5 (docs/live.md has the kinds); may be repeated")
      ->take_all()
      ->allow_extra_args(false);
}

Result<void> check_faults(const std::vector<std::string>& faults, int cameras) {
  for (const std::string& text : faults) {
    const auto fault = parse_fault(text);
    if (!fault) return fault.error();
    if (fault->camera >= cameras)
      return Error{ErrorCode::invalid_argument, fmt::format("fault '{}': the rig's cameras are 0 to {}", text, cameras - 1)};
  }
  return {};
}

Result<void> run_with_faults(Source& source, SensorInput& input, const std::vector<std::string>& faults) {
  if (faults.empty()) return source.run(input);
  std::vector<SensorFault> injected;
  for (const std::string& text : faults) injected.push_back(*parse_fault(text));
  FaultyInput faulty(input, std::move(injected));
  return source.run(faulty);
}

#else

void add_fault_option(CLI::App&, std::vector<std::string>&) {}
Result<void> check_faults(const std::vector<std::string>&, int) { return {}; }
Result<void> run_with_faults(Source& source, SensorInput& input, const std::vector<std::string>&) { return source.run(input); }

#endif

}  // namespace fbvins::app
