// SPDX-License-Identifier: Apache-2.0
// Joins maps of several flights where they saw the same places (docs/derivations/loop.md, Joining maps). Where they lie to one
// another need not be known. Pure functions.
//
//   Result<PlaceMap> both = merge_maps(first, second, options, vocabulary);
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/loop/loop_closer.hpp"

namespace fbvins {

/// All keyframes, sessions and measurements of both, in the frame of the first, tied by loops between them and optimised. Anchors
/// of `second` are kept where both are anchored. Tags without a known place that both have seen are places in common, also
/// alone, where there are two of them. Keyframes that both have are taken once. An error where the maps have no place in common,
/// where what they have in common does not fit, or where the first has more than half of the second's keyframes.
Result<PlaceMap> merge_maps(PlaceMap first, const PlaceMap& second, const LoopOptions& options, const Vocabulary& vocabulary);

struct LeftOutMap {
  std::size_t index;  ///< in what was given
  std::string why;
};
struct MergedMaps {
  PlaceMap map;
  std::vector<LeftOutMap> left_out;
};
/// The first map and all that belong to it, also by way of others. Those that have no place in common with any are left out.
MergedMaps merge_all(std::vector<PlaceMap> maps, const LoopOptions& options, const Vocabulary& vocabulary);

}  // namespace fbvins
