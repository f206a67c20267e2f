// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/frame_contract.hpp"

#include <algorithm>
#include <unordered_set>

namespace fbvins {
namespace {

bool is_finite(const Observation& o) { return o.pixel.allFinite() && o.normalised.allFinite() && o.sqrt_information.allFinite(); }

bool is_possible(const TrackedFeature& f, int cameras) {
  const auto is_of_rig = [cameras](int camera) { return camera >= 0 && camera < cameras; };
  return !f.seen.empty() && is_of_rig(f.lead) && std::ranges::all_of(f.seen, [&](const Observation& o) {
    return is_of_rig(o.camera) && f.by(o.camera) == &o && is_finite(o);
  });
}

int stereo_matches(const std::vector<TrackedFeature>& features) {
  return static_cast<int>(std::ranges::count_if(features, &TrackedFeature::by_several));
}

}  // namespace

bool FrameContract::any_twice(const std::vector<TrackedFeature>& features) {
  ids_.clear();
  for (const TrackedFeature& f : features) ids_.push_back(f.id);
  std::ranges::sort(ids_);
  return std::ranges::adjacent_find(ids_) != ids_.end();
}

const TrackedFrame& FrameContract::enforced(const TrackedFrame& frame, int cameras) {
  const std::vector<TrackedFeature>& features = frame.features;
  const auto is_possible_here = [cameras](const TrackedFeature& f) { return is_possible(f, cameras); };
  const bool good = std::ranges::all_of(features, is_possible_here) && !any_twice(features);
  const bool counted = frame.stats.stereo > 0 || stereo_matches(features) == 0;
  broken_ = 0;
  if (good && counted) return frame;
  accepted_ = frame;
  std::unordered_set<TrackId> seen;
  std::erase_if(accepted_.features, [&](const TrackedFeature& f) { return !is_possible_here(f) || !seen.insert(f.id).second; });
  accepted_.stats.stereo = stereo_matches(accepted_.features);
  broken_ = static_cast<int>(features.size() - accepted_.features.size());
  return accepted_;
}

}  // namespace fbvins
