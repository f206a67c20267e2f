// SPDX-License-Identifier: Apache-2.0
// The outputs of `fbvins live`. Poses matter most: an output that cannot be opened, written or saved is reported, and the flight
// goes on without it. Only a wrong command line ends the program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/kept_map.hpp"
#include "apps/live_summary.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/live/flight_command.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/live/record_switch.hpp"

namespace CLI {
class App;
}

namespace fbvins::app {

struct OutputArguments {
  std::string out, record, web, reset_counter;
  std::vector<std::string> mavlink;
  bool record_images = true, quiet = false;
  bool record_on_request = false;  ///< the record does not begin by itself
  double record_keep_free_mb = 256;

  void add_to(CLI::App& command);
};

/// What went wrong with outputs, said at once on stderr. One thread.
class Troubles {
 public:
  void add(const Error& error);
  void add(const Result<void>& result) {
    if (!result) add(result.error());
  }
  bool any() const { return any_; }

 private:
  bool any_ = false;
};

/// Stands for an output that could not be opened: the status says why, in every line.
class MissingOutput final : public Sink {
 public:
  MissingOutput(std::string name, std::string problem) : name_(std::move(name)), problem_(std::move(problem)) {}
  std::string_view name() const override { return name_; }
  Result<void> take(const LiveEvent&) override { return {}; }
  std::string problem() const override { return problem_; }

 private:
  std::string name_, problem_;
};

/// What a live flight's outputs are about.
struct LiveFlight {
  const Config& config;
  const Source& source;
  std::string source_name;
  const MapArguments& map;
  KeptMap* kept = nullptr;         ///< null: no map
  LoopMap* loop_map = nullptr;     ///< what is kept
  RecordSwitch* record = nullptr;  ///< set by add_outputs(); null: no file for records was named
};

/// Adds the sinks that the command line asks for. Errors: a wrong command line, a service manager that is not there.
Result<void> add_outputs(const OutputArguments& arguments, LiveFlight& flight, LiveSystem& live, LiveTotals& totals,
                         Troubles& troubles);
/// reset, save_map, load_map, start_record and stop_record. `flight` and `live` must outlive them.
std::vector<FlightCommand> flight_commands(const LiveFlight& flight, LiveSystem& live);
/// The page, which serves when all sinks are there: its viewers' commands reach them.
Result<void> add_page(const std::string& where, const LiveFlight& flight, LiveSystem& live);

/// The IMU's state of the flight before; a file that cannot be used is set aside and reported.
std::optional<ImuState> imu_state_for_flight(const std::string& file, const ImuNoise& imu);

}  // namespace fbvins::app
