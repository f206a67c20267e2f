// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/flight_join.hpp"

#include <algorithm>

#include "fbvins/loop/map_sessions.hpp"

namespace fbvins {

FlightJoin::FlightJoin(const PlaceMap& map) : anchored_(map.anchored), before_(fit_of(map, [](std::uint32_t) { return false; })) {
  for (const MapKeyframe& k : map.keyframes()) {
    old_.push_back({k.id, k.T_MB, k.loops_ending_here});
    first_session_ = std::max(first_session_, k.session + 1);
  }
  old_sessions_ = map.sessions;
  for (const MapSession& s : map.sessions) first_session_ = std::max(first_session_, s.number + 1);
}

std::map<std::uint32_t, std::string> FlightJoin::objections(const PlaceMap& map) const {
  std::set<std::uint32_t> judged;
  for (const MapKeyframe& k : map.keyframes())
    if (k.placed && is_of_flight(k.session) && (!old_.empty() || k.session != first_session_)) judged.insert(k.session);
  std::map<std::uint32_t, std::string> out;
  for (const std::uint32_t session : judged) {
    const auto refused = refused_.find(session);
    std::string why = objection(before_, fit_of(map, [&](std::uint32_t s) { return s == session; }),
                                refused == refused_.end() ? 0 : refused->second);
    if (!why.empty()) out.emplace(session, std::move(why));
  }
  return out;
}

PlaceMap FlightJoin::without(PlaceMap kept, const std::set<std::uint32_t>& sessions) const {
  take_out_sessions(kept, sessions);
  kept.anchored = anchored_ || (kept.anchored && !kept.anchors.empty());
  const bool same_M = kept.anchored == anchored_;  // else what joins has put M into its building
  for (const Old& old : old_) {
    MapKeyframe* k = kept.find(old.id);
    if (k == nullptr) continue;
    k->loops_ending_here = old.loops_ending_here;
    if (same_M) k->T_MB = old.T_MB;
  }
  for (const MapSession& old : old_sessions_)
    if (same_M) kept.session(old.number, old.began).log_scale = old.log_scale;
  const bool some_joined = std::ranges::any_of(kept.keyframes(), [&](const MapKeyframe& k) { return is_of_flight(k.session); });
  if (some_joined) kept.optimise({}, same_M ? first_session_ : 0);
  return kept;
}

}  // namespace fbvins
