// SPDX-License-Identifier: Apache-2.0
// Tags as landmarks of the map: those whose place in the building nobody has measured. What a keyframe shows of a tag is a
// relative pose of the two; two keyframes that show the same tag are tied by it, in one flight or in two, as by a recognised
// place (docs/derivations/loop.md, L27). Pure functions.
//
//   for (const MapTag* before : tags_before(map, seen, path_m)) map.edges.push_back(tag_edge(*before, seen));
//   remember_tag(map, seen);
#pragma once

#include <vector>

#include "fbvins/loop/place_map.hpp"

namespace fbvins {

/// The same tag as seen from another body, `other`, that is at T_other_this with a covariance of (dp in the other, dtheta in
/// this).
MapTag carried(MapTag tag, KeyframeId other, const Pose<B, B>& T_other_this, const Mat6& covariance);

/// From the keyframe that showed the tag before to the one that shows it now.
MapEdge tag_edge(const MapTag& before, const MapTag& now);

/// What the map knows of the tag with this number, the newest first: but not from keyframes of the same session less than 3 m
/// before on its way, which the odometry ties better, and not from those without a place in M.
std::vector<const MapTag*> tags_before(const PlaceMap& map, const MapTag& now);

/// Of each pass before the tag the most certain view is kept, and of a tag the newest twelve.
void remember_tag(PlaceMap& map, MapTag now);

}  // namespace fbvins
