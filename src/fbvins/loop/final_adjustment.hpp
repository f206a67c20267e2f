// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment of a whole map once the flight is over: all keyframes and all points that two of them have seen, and the
// IMU's readings between keyframes where they are known (docs/derivations/loop.md,
// L16, L18, L19). Offline; one thread; the same map in gives the same map out.
//
//   FinalAdjustmentReport report = adjust_map(map, options.verification);
#pragma once

#include "fbvins/loop/map_report.hpp"
#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

/// Adjusts the keyframes that have a place in M, and aligns M with gravity about the first one. A map without two views of one
/// point stays as it is, and so does one whose result does not fit better than the start (`refused` says why).
FinalAdjustmentReport adjust_map(PlaceMap& map, const PlaceVerifierOptions& matching);

}  // namespace fbvins
