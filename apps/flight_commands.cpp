// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "apps/live_outputs.hpp"

namespace fbvins::app {
namespace {

using Told = FlightCommand::Told;

Error refused(std::string sentence) { return {ErrorCode::invalid_argument, std::move(sentence)}; }

/// A map changes, and is saved, with keyframes, which need a pose.
bool has_pose(const LiveSystem& live) { return live.status().health.has_pose(); }

std::string cannot_save_map(const MapArguments& map) {
  if (!map.wanted()) return "this flight has no map: start it with --map FILE";
  if (map.save.empty()) return "no file for the map was named: start with --map FILE or --save-map FILE";
  return {};
}

std::string cannot_load_map(const MapArguments& map) {
  if (!map.wanted()) return "this flight has no map: start it with --map FILE";
  if (map.load.empty() && map.save.empty()) return "no file of a map was named: start with --map FILE or --load-map FILE";
  return {};
}

std::string cannot_record(const LiveFlight& flight) {
  return flight.record == nullptr ? "no file for records was named: start with --record FILE" : "";
}

void save_map_of(const LiveFlight& flight, const LiveSystem& live, const Told& told) {
  if (const std::string why = cannot_save_map(flight.map); !why.empty()) return told(refused(why));
  if (!has_pose(live)) return told(refused("there is no pose: the map is saved with the next keyframe, which needs one"));
  const bool waits = flight.kept->request_save([told, file = flight.map.save](const Result<void>& saved) {
    if (saved) told("the map is saved in " + file);
    else told(saved.error());
  });
  if (!waits) told(refused("too many have asked for the map already"));
}

void load_map_of(const LiveFlight& flight, const LiveSystem& live, const Told& told) {
  MapArguments again = flight.map;
  if (again.load.empty()) again.load = again.save;
  if (const std::string why = cannot_load_map(flight.map); !why.empty()) return told(refused(why));
  if (!has_pose(live)) return told(refused("there is no pose: the map is loaded before the next keyframe, which needs one"));
  const bool waits = flight.kept->before_next_keyframe([=, &flight] {
    auto map = make_map(again, flight.source.rig(), flight.config.loop);
    if (!map) return told(map.error());
    const int keyframes = (*map)->keyframes();
    flight.loop_map->take_over(*std::move(map));
    told(fmt::format("{} keyframes of {}; what this flight added since that was saved is forgotten", keyframes, again.load));
  });
  if (!waits) told(refused("a map is about to be loaded already"));
}

void switch_record(const LiveFlight& flight, bool on, const Told& told) {
  if (const std::string why = cannot_record(flight); !why.empty()) return told(refused(why));
  const Result<std::string> path = on ? flight.record->start() : flight.record->stop();
  if (path) told(fmt::format("{} {}", on ? "recording" : "the record is", *path));
  else told(path.error());
}

}  // namespace

std::vector<FlightCommand> flight_commands(const LiveFlight& flight, LiveSystem& live) {
  return {{"reset",
           [&live](const Told& told) {
             live.start_again();
             live.mark("reset");
             told(std::string("the estimator starts again with the next image"));
           }},
          {"save_map", [&](const Told& told) { save_map_of(flight, live, told); }, cannot_save_map(flight.map)},
          {"load_map", [&](const Told& told) { load_map_of(flight, live, told); }, cannot_load_map(flight.map)},
          {"start_record", [&](const Told& told) { switch_record(flight, true, told); }, cannot_record(flight)},
          {"stop_record", [&](const Told& told) { switch_record(flight, false, told); }, cannot_record(flight)}};
}

}  // namespace fbvins::app
