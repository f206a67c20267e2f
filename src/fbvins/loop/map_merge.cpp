// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace fbvins {
namespace {

/// Keyframes of `second` with a keyframe of `first` of the same image: of the same stamp, with the same features.
std::size_t keyframes_in_both(const PlaceMap& first, const PlaceMap& second) {
  std::multimap<Time, const Place*> of_first;
  for (const MapKeyframe& k : first.keyframes()) of_first.emplace(k.t, &k.place);
  return static_cast<std::size_t>(std::ranges::count_if(second.keyframes(), [&](const MapKeyframe& k) {
    const auto [begin, end] = of_first.equal_range(k.t);
    return std::any_of(begin, end, [&](const auto& other) {
      return other.second->features == k.place.features && other.second->descriptors == k.place.descriptors;
    });
  }));
}

}  // namespace

Result<PlaceMap> merge_maps(PlaceMap first, const PlaceMap& second, const LoopOptions& options, const Vocabulary& vocabulary) {
  if (first.boosted != second.boosted)
    return Error{ErrorCode::invalid_argument, "one map holds boosted descriptors, the other raw ones"};
  if (const std::size_t both = keyframes_in_both(first, second); both > 0)
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("{} of its {} keyframes are in the other map already: they would be there twice", both, second.size())};
  StereoRig rig;  // only the left camera's extrinsics matter: nothing is extracted
  rig.T_BC0 = first.T_BC0;
  LoopOptions merging = options;
  merging.degrees_of_freedom = 6;
  LoopCloser closer(rig, merging, vocabulary, std::move(first));
  bool joined = false;
  for (const MapKeyframe& k : second.keyframes()) {
    // The poses of its map serve as odometry, already corrected; the body may sit elsewhere on the other rig.
    const Pose<M, C0> T_MC = k.T_MB * second.T_BC0;
    const Pose<M, B> T_MB = T_MC * rig.T_BC0.inverse();
    Place place = k.place;
    place.words = vocabulary.words_of(place.descriptors);  // a file keeps none
    Keyframe flown;
    flown.id = FrameId{k.id.value};
    flown.t = k.t;
    flown.gauge.T_GB = {T_MB.q, T_MB.p};
    joined |= closer.process(std::move(place), flown).localised;
  }
  if (!joined) return Error{ErrorCode::invalid_argument, "the two maps have no place in common"};
  closer.finish();
  return closer.map();
}

}  // namespace fbvins
