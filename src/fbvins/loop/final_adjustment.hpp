// SPDX-License-Identifier: Apache-2.0
// The best map there is time for once the flight is over: all keyframes and all points that two of them have seen,
// moved together until every sight fits (docs/derivations/loop.md, L16). Offline; one thread; the same map in gives
// the same map out.
//
//   FinalAdjustmentReport report = adjust_map(map, options.verification);
#pragma once

#include "fbvins/loop/map_report.hpp"
#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

/// Moves the placed keyframes; the first one stays. A map without two views of one point stays as it is.
FinalAdjustmentReport adjust_map(PlaceMap& map, const PlaceVerifierOptions& matching);

}  // namespace fbvins
