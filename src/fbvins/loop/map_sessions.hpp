// SPDX-License-Identifier: Apache-2.0
// The sessions of a map: each is a flight, or a part of one between two restarts of the odometry. Which there are, what is known
// of them, and the map without some of them. Pure functions.
//
//   for (const SessionInMap& s : sessions_in(map)) print(s.known.number, s.keyframes);
//   Result<PlaceMap> before_tuesday = without_sessions(map, {3, 4});
#pragma once

#include <set>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {

struct SessionInMap {
  MapSession known;
  int keyframes = 0;  ///< that are still in the map
  int loops = 0;      ///< in the map, with keyframes of other sessions
};
/// In order of number.
std::vector<SessionInMap> sessions_in(const PlaceMap& map);

/// Completes what a map remembers by what its keyframes and loops show: files of one session, and of earlier versions, hold no
/// more.
void remember_sessions(PlaceMap& map);

/// Takes out all that came with these sessions: keyframes, loops, anchors. Unlike PlaceMap::remove() it joins no neighbours:
/// nothing that the sessions measured remains.
void take_out_sessions(PlaceMap& map, const std::set<std::uint32_t>& numbers);

/// The map as if these sessions had not been flown, but for keyframes that were removed because of them; the graph is optimised.
/// An error where a session does not exist, or nothing would be left.
Result<PlaceMap> without_sessions(PlaceMap map, const std::set<std::uint32_t>& numbers);

}  // namespace fbvins
