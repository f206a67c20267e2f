// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/frame_contract.hpp"

#include <algorithm>
#include <unordered_set>

namespace fbvins {
namespace {

bool is_finite(const std::optional<Observation>& o) {
  return !o || (o->pixel.allFinite() && o->normalised.allFinite() && o->sqrt_information.allFinite());
}

bool is_possible(const TrackedFeature& f) { return (f.left || f.right) && is_finite(f.left) && is_finite(f.right); }

int stereo_matches(const std::vector<TrackedFeature>& features) {
  return static_cast<int>(std::ranges::count_if(features, [](const TrackedFeature& f) { return f.left && f.right; }));
}

}  // namespace

bool FrameContract::any_twice(const std::vector<TrackedFeature>& features) {
  ids_.clear();
  for (const TrackedFeature& f : features) ids_.push_back(f.id);
  std::ranges::sort(ids_);
  return std::ranges::adjacent_find(ids_) != ids_.end();
}

const TrackedFrame& FrameContract::enforced(const TrackedFrame& frame) {
  const std::vector<TrackedFeature>& features = frame.features;
  const bool good = std::ranges::all_of(features, is_possible) && !any_twice(features);
  const bool counted = frame.stats.stereo > 0 || stereo_matches(features) == 0;
  broken_ = 0;
  if (good && counted) return frame;
  accepted_ = frame;
  std::unordered_set<TrackId> seen;
  std::erase_if(accepted_.features, [&](const TrackedFeature& f) { return !is_possible(f) || !seen.insert(f.id).second; });
  accepted_.stats.stereo = stereo_matches(accepted_.features);
  broken_ = static_cast<int>(features.size() - accepted_.features.size());
  return accepted_;
}

}  // namespace fbvins
