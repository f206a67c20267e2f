// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_sessions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace fbvins {
namespace {

/// Loops with other sessions, by session.
std::map<std::uint32_t, int> loops_with_others(const PlaceMap& map) {
  std::map<std::uint32_t, int> loops;
  for (const MapEdge& e : map.edges) {
    if (e.kind != MapEdge::Kind::loop) continue;
    const std::uint32_t a = map.find(e.from)->session, b = map.find(e.to)->session;
    if (a != b) ++loops[a], ++loops[b];
  }
  return loops;
}

}  // namespace

std::vector<SessionInMap> sessions_in(const PlaceMap& map) {
  std::map<std::uint32_t, SessionInMap> all;
  for (const MapSession& s : map.sessions) all[s.number].known = s;
  for (const MapKeyframe& k : map.keyframes()) ++all[k.session].keyframes;
  for (const auto& [number, loops] : loops_with_others(map)) all[number].loops = loops;
  std::vector<SessionInMap> out;
  for (const auto& [number, session] : all) out.push_back(session);
  return out;
}

void remember_sessions(PlaceMap& map) {
  std::set<std::uint32_t> known;
  for (const MapSession& s : map.sessions) known.insert(s.number);
  const std::map<std::uint32_t, int> loops = loops_with_others(map);
  for (const MapKeyframe& k : map.keyframes()) {
    if (known.count(k.session) > 0) continue;
    MapSession& s = map.session(k.session, k.t);
    s.ended = k.t;
    ++s.keyframes;
    if (const auto found = loops.find(k.session); found != loops.end()) s.loops = found->second;
  }
}

void take_out_sessions(PlaceMap& map, const std::set<std::uint32_t>& numbers) {
  if (numbers.empty()) return;
  const auto gone = [&](KeyframeId id) { return numbers.count(map.find(id)->session) > 0; };
  std::erase_if(map.edges, [&](const MapEdge& e) { return gone(e.from) || gone(e.to); });
  std::erase_if(map.anchors, [&](const MapAnchor& a) { return gone(a.keyframe); });
  std::erase_if(map.tags, [&](const MapTag& t) { return gone(t.keyframe); });
  std::erase_if(map.keyframes(), [&](const MapKeyframe& k) { return numbers.count(k.session) > 0; });
  std::erase_if(map.sessions, [&](const MapSession& s) { return numbers.count(s.number) > 0; });
}

Result<PlaceMap> without_sessions(PlaceMap map, const std::set<std::uint32_t>& numbers) {
  remember_sessions(map);
  for (const std::uint32_t number : numbers)
    if (std::ranges::none_of(map.sessions, [&](const MapSession& s) { return s.number == number; }))
      return Error{ErrorCode::invalid_argument, fmt::format("there is no session {} in the map", number)};
  const std::size_t before = map.size();
  take_out_sessions(map, numbers);
  if (map.empty()) return Error{ErrorCode::invalid_argument, fmt::format("none of its {} keyframes would be left", before)};
  map.anchored = map.anchored && !map.anchors.empty();
  map.optimise({});
  return map;
}

}  // namespace fbvins
