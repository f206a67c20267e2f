// SPDX-License-Identifier: Apache-2.0
// What leaves a map after a flight in it, so that a map flown in every day stays bounded (docs/derivations/loop.md, Upkeep): new
// keyframes that bring nothing, old ones that several flights did not know again though they stood there, and of many views from
// one spot those that were known again least. Pure function, but for the memory of what was missed.
//
//   for (KeyframeId id : what_leaves(map, {session}, verifier)) map.remove(id);
#pragma once

#include <set>
#include <vector>

#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

/// `flown`: the flight's sessions, placed and consistent with the map. Sets MapKeyframe::missed of older keyframes where the
/// flight stood. Never the first keyframe, which defines M.
std::vector<KeyframeId> what_leaves(PlaceMap& map, const std::set<std::uint32_t>& flown, PlaceVerifier& verifier);

}  // namespace fbvins
