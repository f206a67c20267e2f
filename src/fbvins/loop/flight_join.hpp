// SPDX-License-Identifier: Apache-2.0
// Which sessions of a flight join the map that it was flown in, and the map without the others: a bad flight leaves it as it was,
// to the byte. A value; one thread at a time.
//
//   FlightJoin join(loaded_map);
//   join.note_refused(session, 2);
//   for (const auto& [session, why] : join.objections(map)) say(why);
//   PlaceMap as_before = join.without(map, {session});
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "fbvins/loop/map_consistency.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

class FlightJoin {
 public:
  /// `map`: as it was loaded; empty where the flight begins a new one, of which the first session is a part in any case.
  explicit FlightJoin(const PlaceMap& map);

  bool began_map() const { return old_.empty(); }
  /// The flight's first session has this number or a larger one.
  std::uint32_t first_session() const { return first_session_; }
  bool is_of_flight(std::uint32_t session) const { return session >= first_session_; }
  void note_refused(std::uint32_t session, int places) { refused_[session] += places; }

  /// Sessions of the flight that have a place in M but do not join, and why.
  std::map<std::uint32_t, std::string> objections(const PlaceMap& map) const;
  /// The map as it was loaded, and the other sessions of the flight, optimised about it: that costs nothing for the size of the
  /// map.
  PlaceMap without(PlaceMap map, const std::set<std::uint32_t>& sessions) const;

 private:
  struct Old {
    KeyframeId id;
    Pose<M, B> T_MB;
    int loops_ending_here;
  };

  std::vector<Old> old_;
  std::vector<MapSession> old_sessions_;
  bool anchored_ = false;
  std::uint32_t first_session_ = 0;
  PartFit before_;
  std::map<std::uint32_t, int> refused_;
};

}  // namespace fbvins
