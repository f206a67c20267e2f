// SPDX-License-Identifier: Apache-2.0
#include "apps/web_page.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <utility>

#include "apps/stop_signal.hpp"
#include "apps/terminal.hpp"

#ifdef FBVINS_WITH_WEB
#include "apps/web_options.hpp"
#include "fbvins/web/finished_flight.hpp"
#include "fbvins/web/flight_player.hpp"
#include "fbvins/web/page_files.hpp"
#include "fbvins/web/web_sink.hpp"
#endif

namespace fbvins::app {

#ifdef FBVINS_WITH_WEB

namespace {

constexpr std::chrono::seconds kTryAgain{2};

WebFlight described(WebFlight flight) {
  flight.program = "fbvins " FBVINS_VERSION;
  return flight;
}

/// Serves the page, and prints its address on stderr.
Result<void> begin(WebSink& sink) {
  if (Result<void> begun = sink.begin(page_files()); !begun) return begun;
  if (const std::string problem = sink.problem(); !problem.empty()) warn(problem + "; it is tried again");
  note(fmt::format("the page is {}", sink.url()));
  return {};
}

}  // namespace

Result<WebOptions> web_options(const std::string& where) {
  auto address = parse_web_address(where);
  if (!address) return address.error();
  if (page_files().empty())
    return Error{ErrorCode::invalid_argument, "this program was built without its page: build it again where npm is installed"};
  WebOptions options{.address = *address};
  if (const char* token = std::getenv("FBVINS_WEB_TOKEN")) {
    options.token = token;
    if (!token_usable(options.token))
      return Error{ErrorCode::invalid_argument, "FBVINS_WEB_TOKEN: it must have eight or more letters, digits, - and _"};
  } else if (!address->loopback()) {
    auto made = make_token();
    if (!made) return made.error();
    options.token = *std::move(made);
  }
  return options;
}

Result<void> show_finished_flight(const std::string& path, const std::string& recording, const std::string& where) {
  const auto flight = open_finished_flight(path, recording);
  if (!flight) return flight.error();
  FlightPlayer player(**flight);
  const auto options = web_options(where);
  if (!options) return options.error();
  const auto sink = WebSink::prepare(*options, described(player.description()),
                                     {.replay = [&](const WebCommand& command) { player.command(command); }});
  if (Result<void> begun = begin(*sink); !begun) return begun;
  const StopSignal stop([&] { player.stop(); });
  player.play(*sink);
  return sink->finish();
}

Result<LivePage> open_live_page(LivePageOptions options) {
  WebFlight flight{.source = std::move(options.source), .frontend = std::move(options.frontend)};
  flight.can_mark = true;
  flight.q_B_vehicle = options.q_B_vehicle;
  auto web = web_options(options.where);
  if (!web) return web.error();
  web->try_again = kTryAgain;
  auto sink = WebSink::prepare(*web, described(std::move(flight)),
                               {.mark = std::move(options.mark), .commands = std::move(options.commands)});
  LivePage page;
  page.begin = [to = sink.get()] { return begin(*to); };
  page.sink = std::move(sink);
  return page;
}

#else

namespace {
Error without_boost() { return {ErrorCode::invalid_argument, "this program was built without Boost, which serves the page"}; }
}  // namespace

Result<LivePage> open_live_page(LivePageOptions) { return without_boost(); }
Result<void> show_finished_flight(const std::string&, const std::string&, const std::string&) { return without_boost(); }

#endif

}  // namespace fbvins::app
