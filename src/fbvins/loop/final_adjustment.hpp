// SPDX-License-Identifier: Apache-2.0
// The best map there is time for once the flight is over: all keyframes and all points that two of them have seen, moved
// together until every observation fits, and the IMU's readings between keyframes where they are known (docs/derivations/loop.md,
// L16, L18, L19). Offline; one thread; the same map in gives the same map out.
//
//   FinalAdjustmentReport report = adjust_map(map, options.verification);
#pragma once

#include "fbvins/loop/map_report.hpp"
#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

/// Moves the placed keyframes against one another, and turns the map level about the first one. A map without two views of one
/// point stays as it is, and so does one whose result would not be more plausible than its beginning (`refused` says why).
FinalAdjustmentReport adjust_map(PlaceMap& map, const PlaceVerifierOptions& matching);

}  // namespace fbvins
