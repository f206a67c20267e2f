// SPDX-License-Identifier: Apache-2.0
// Plays a finished flight to a page as if it were live: begins when somebody looks; a viewer may pause and seek.
//
//   FlightPlayer player(*flight);
//   auto sink = WebSink::create(options, page_files(), player.description(), {.replay = [&](auto& c) { player.command(c); }});
//   player.play(**sink);                  // until stop()
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>

#include "fbvins/web/finished_flight.hpp"
#include "fbvins/web/web_sink.hpp"

namespace fbvins {

class FlightPlayer {
 public:
  explicit FlightPlayer(const FinishedFlight& flight) : flight_(flight) {}

  WebFlight description() const;
  /// Seek, play, pause: from any thread.
  void command(const WebCommand& command);
  /// In this thread, until stop().
  void play(WebSink& sink);
  /// From any thread.
  void stop();

 private:
  double time_s(std::size_t i) const { return (flight_.time_of(i) - flight_.time_of(0)).seconds(); }
  double end_s() const { return time_s(flight_.size() - 1); }
  void seek_to(WebSink& sink, double t_s);
  void apply(WebSink& sink, const WebCommand& command);
  std::optional<WebCommand> wait_for_command(std::chrono::steady_clock::time_point until);

  const FinishedFlight& flight_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<WebCommand> wanted_;  ///< the newest command that waits
  bool stopped_ = false;

  // Used by play()'s thread alone.
  using Clock = std::chrono::steady_clock;
  std::size_t next_ = 0;  ///< index of the next event
  bool playing_ = false;
  Clock::time_point began_;  ///< when the event at 0 s would have been due
  double shown_s_ = 0;
};

}  // namespace fbvins
