// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/flight_player.hpp"

#include <algorithm>
#include <utility>

namespace fbvins {
namespace {

using namespace std::chrono_literals;

constexpr auto kLookForViewers = 100ms;

std::chrono::nanoseconds seconds(double s) { return std::chrono::nanoseconds(Duration::from_seconds(s).ns); }

}  // namespace

WebFlight FlightPlayer::description() const {
  WebFlight flight{.source = flight_.name, .frontend = flight_.frontend, .replay = true};
  flight.duration_s = end_s();
  // Thinned out to what a screen can show.
  const std::size_t stride = flight_.path.size() / 6000 + 1;
  for (std::size_t i = 0; i < flight_.path.size(); i += stride) flight.whole_path.push_back(flight_.path[i]);
  return flight;
}

void FlightPlayer::command(const WebCommand& command) {
  const std::lock_guard lock(mutex_);
  wanted_ = command;
  changed_.notify_all();
}

void FlightPlayer::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

/// None when `until` has come, or at stop().
std::optional<WebCommand> FlightPlayer::wait_for_command(Clock::time_point until) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, until, [&] { return stopped_ || wanted_; });
  return std::exchange(wanted_, std::nullopt);
}

void FlightPlayer::play(WebSink& sink) {
  sink.set_start(flight_.time_of(0));
  bool begun = false;
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return;
    }
    if (!begun && sink.viewers() > 0) {
      begun = true;
      apply(sink, {WebCommand::Kind::play, {}});
    }
    const auto due = playing_ ? began_ + seconds(time_s(next_)) : Clock::now() + kLookForViewers;
    if (const auto command = wait_for_command(due)) {
      begun = true;
      apply(sink, *command);
    } else if (playing_ && Clock::now() >= due) {
      (void)sink.take(flight_.event(next_));
      shown_s_ = time_s(next_);
      if (++next_ < flight_.size()) continue;
      playing_ = false;
      sink.show_replay(shown_s_, false);
    }
  }
}

void FlightPlayer::apply(WebSink& sink, const WebCommand& command) {
  using Kind = WebCommand::Kind;
  if (command.kind == Kind::seek) seek_to(sink, std::clamp(command.t_s, 0.0, end_s()));
  else if (command.kind == Kind::play && next_ == flight_.size()) seek_to(sink, 0);
  playing_ = (command.kind == Kind::play || (command.kind == Kind::seek && playing_)) && next_ < flight_.size();
  began_ = Clock::now() - seconds(shown_s_);
  sink.show_replay(shown_s_, playing_);
}

/// Goes through all events from the beginning, as a page shows the sum of what it has received.
void FlightPlayer::seek_to(WebSink& sink, double t_s) {
  std::size_t end = 0;
  while (end < flight_.size() && time_s(end) <= t_s) ++end;
  // The events of the last image are sent as new ones, those before it as history.
  std::size_t last = end;
  while (last > 0 && flight_.time_of(last - 1) == flight_.time_of(end - 1)) --last;
  sink.begin_replay();
  for (std::size_t i = 0; i < last; ++i)
    if (!flight_.is_image(i)) (void)sink.take(flight_.event(i));
  sink.end_replay();
  for (std::size_t i = last; i < end; ++i) (void)sink.take(flight_.event(i));
  next_ = end;
  shown_s_ = end > 0 ? time_s(end - 1) : 0;
}

}  // namespace fbvins
