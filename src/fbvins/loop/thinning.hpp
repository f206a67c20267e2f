// SPDX-License-Identifier: Apache-2.0
// Which keyframes are removed from a map: above `thin_above` redundant ones, above `max_keyframes` those that add least
// (docs/derivations/loop.md, Thinning). One thread at a time.
//
//   Thinning thinning(600, 3000, map);                     // keyframes that are in it already stay until end_flight()
//   thinning.note(id, loops, map.size());                  // every keyframe, with the loops that end there
//   while (auto id = thinning.next(map)) map.remove(*id);  // must be removed before the next call
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/loop/place_map.hpp"

namespace fbvins {

class Thinning {
 public:
  Thinning(int thin_above, int max_keyframes) : thin_above_(thin_above), max_keyframes_(max_keyframes) {}
  /// In a map that has keyframes already, a flight removes only its own, of which it may have a fifth of `max_keyframes` in any
  /// case.
  Thinning(int thin_above, int max_keyframes, const PlaceMap& map);
  /// From now on all keyframes may go.
  void end_flight() { loaded_ = 0; }

  /// Remembers `id` as redundant where one of the loops shows an earlier keyframe of nearly the same pose. The fuller
  /// the map (`size`, without `id`), the less is new.
  void note(KeyframeId id, std::span<const MapEdge> loops, std::size_t size);
  /// The next one that should go, if any.
  std::optional<KeyframeId> next(const PlaceMap& map);

 private:
  int thin_above_, max_keyframes_;
  std::size_t loaded_ = 0;  ///< keyframes from before the flight: the first ones
  std::vector<KeyframeId> redundant_;
};

/// The keyframe that takes over the poses attached to `gone`: a neighbour of its session, else the last one before it that
/// has a place in M, if `gone` has one. Null for a session's only keyframe that has none.
const MapKeyframe* successor_of(const PlaceMap& map, const MapKeyframe& gone);

}  // namespace fbvins
