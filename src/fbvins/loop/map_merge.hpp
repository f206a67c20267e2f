// SPDX-License-Identifier: Apache-2.0
// Joins maps of several flights where they saw the same places. Pure function.
//
//   Result<PlaceMap> both = merge_maps(first, second, options, vocabulary);
#pragma once

#include "fbvins/core/result.hpp"
#include "fbvins/loop/loop_closer.hpp"

namespace fbvins {

/// The keyframes of `second` are processed as a flight that continues `first`; then everything is optimised with six degrees of
/// freedom. An error where they have no place in common, or a keyframe: a map merged with itself would hold everything twice.
Result<PlaceMap> merge_maps(PlaceMap first, const PlaceMap& second, const LoopOptions& options, const Vocabulary& vocabulary);

}  // namespace fbvins
