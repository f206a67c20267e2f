// SPDX-License-Identifier: Apache-2.0
// Every keyframe of the flight, each attached to one that is still in the map, so that the poses of the whole flight follow
// the map although keyframes are removed from it. Of a flight of many hours, older keyframes are left out: memory and time stay
// bounded, and poses between those that are kept are interpolated. One thread at a time.
//
//   FlightKeyframes flight;
//   flight.add(t, id);
//   flight.hand_over(gone.id, successor.id, successor.T_MB.inverse() * gone.T_MB);
//   Trajectory<M> in_map = flight.corrected(map, trajectory_in_G);
#pragma once

#include <vector>

#include "fbvins/loop/place_map.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

class FlightKeyframes {
 public:
  void add(Time t, KeyframeId id);
  std::size_t size() const { return entries_.size(); }
  /// Attaches what was attached to `gone` to `successor`.
  void hand_over(KeyframeId gone, KeyframeId successor, const Pose<B, B>& T_successor_gone);
  /// Drops what was attached to `gone`.
  void drop(KeyframeId gone);
  /// Poses of a flight (in its gauge) as the map has them now: exact at keyframes, interpolated between them. Keyframes that
  /// have no place in M are passed over; empty where there is no other.
  Trajectory<M> corrected(const PlaceMap& map, const Trajectory<G>& in_G) const;

 private:
  struct Entry {
    Time t;
    KeyframeId kept;
    Pose<B, B> T_kept_B;
  };
  std::vector<Entry> entries_;
};

}  // namespace fbvins
