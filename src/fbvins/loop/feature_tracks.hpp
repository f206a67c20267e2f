// SPDX-License-Identifier: Apache-2.0
// Which features of a map's keyframes are the same point: keyframes that are neighbours in time or joined by a loop
// are matched near where the map predicts, and matches are chained. Pure function.
//
//   for (const FeatureTrack& track : feature_tracks(map, {}, 3, 8.0)) use(track);
#pragma once

#include <cstddef>
#include <vector>

#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

/// A feature of a keyframe, both by their index in the map's lists.
struct FeatureView {
  std::size_t keyframe = 0, feature = 0;
};

/// Views of one point, at most one a keyframe, in order of keyframe.
using FeatureTrack = std::vector<FeatureView>;

/// Tracks of two views and more, over placed keyframes. `neighbours`: how many earlier keyframes of its flight each
/// keyframe is matched with; `radius_px`: how far from the prediction.
std::vector<FeatureTrack> feature_tracks(const PlaceMap& map, const PlaceVerifierOptions& matching, int neighbours,
                                         double radius_px);

}  // namespace fbvins
