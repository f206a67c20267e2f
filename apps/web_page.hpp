// SPDX-License-Identifier: Apache-2.0
// The page of `fbvins live --web` and `fbvins view`. In a program built without Boost, or without npm to get the page's
// libraries, it is an error.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/flight_command.hpp"
#include "fbvins/live/sink.hpp"

namespace fbvins::app {

inline constexpr const char* kWebHelp =
    "serve a page that shows the flight: [ADDRESS:]PORT; without an address for this machine alone, otherwise with a token "
    "(docs/web.md)";

/// `fbvins view`: until SIGINT or SIGTERM.
Result<void> show_finished_flight(const std::string& flight, const std::string& recording, const std::string& where);

/// A live flight's page as a sink. It serves from `begin` on, which is called when all sinks are there. While its address is in
/// use it tries again every other second, and says so in the status.
struct LivePage {
  std::unique_ptr<Sink> sink;
  std::function<Result<void>()> begin;
};
struct LivePageOptions {
  std::string where, source, frontend;
  std::optional<Quat> q_B_vehicle;  ///< takes the vehicle's axes (forward, right, down) to the IMU's; none: they are not known
  std::function<void(std::string)> mark;
  std::vector<FlightCommand> commands;
};
Result<LivePage> open_live_page(LivePageOptions options);

}  // namespace fbvins::app
