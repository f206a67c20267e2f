// SPDX-License-Identifier: Apache-2.0
// M as a controller flies in it: MapUpdate::T_MW_smooth, and a count of its jumps, of which a controller has to be told.
//
//   FlownMap map;
//   map.take(update);                                  // every MapUpdate
//   if (auto T_MW = map.T_MW(pose.reset_counter)) fly(*T_MW * pose.T_WB, pose.reset_counter + map.jumps());
#pragma once

#include <cstdint>
#include <optional>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/loop.hpp"

namespace fbvins {

class FlownMap {
 public:
  void take(const MapUpdate& update);
  /// Of the W with this counter (Odometry::reset_counter); none while it is not known where that is in M.
  std::optional<Pose<M, W>> T_MW(std::uint32_t reset_counter) const;
  /// One whenever a vehicle that is in M or has been takes another place in it from one moment to the next: found in a map, M
  /// moved to the building's frame, or another W.
  std::uint32_t jumps() const { return jumps_; }

 private:
  std::optional<std::uint32_t> reset_counter_;  // of the W that T_MW_ is of
  Pose<M, W> T_MW_;
  std::uint32_t jumps_ = 0;
};

}  // namespace fbvins
