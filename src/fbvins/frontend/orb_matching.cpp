// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_matching.hpp"

#include <algorithm>

namespace fbvins {
namespace {

/// Larger than the distance of any two descriptors.
constexpr int kFar = 257;

/// The best candidate, if it passes the distance and ratio tests; the second best is one farther than kRival_px away. -1 if none.
int pick_match(std::span<const std::int32_t> candidates, std::span<const std::uint16_t> distances,
               std::span<const Keypoint> keypoints, int max_distance_bits, int* distance) {
  int best = -1, first = kFar;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (distances[i] < first) first = distances[i], best = candidates[i];
  if (best < 0 || first > max_distance_bits) return -1;
  int second = kFar;
  const Keypoint& winner = keypoints[static_cast<std::size_t>(best)];
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Keypoint& rival = keypoints[static_cast<std::size_t>(candidates[i])];
    const double same = kRival_px * std::max(rival.scale, winner.scale);
    if ((rival.pixel - winner.pixel).squaredNorm() > same * same) second = std::min<int>(second, distances[i]);
  }
  if (second < kFar && !(first < kMatchRatio * second)) return -1;
  *distance = first;
  return best;
}

}  // namespace

void GuidedMatcher::match(std::span<const GuidedQuery> queries, const MatchCandidates& candidates, const KeypointGrid& grid,
                          std::vector<int>& found) {
  const auto& [keypoints, descriptors, usable] = candidates;
  found.assign(queries.size(), -1);
  owner_.assign(keypoints.size(), -1);
  owner_distance_.assign(keypoints.size(), kFar);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const GuidedQuery& query = queries[i];
    grid.near(query.px, query.radius_px, query.level, keypoints, near_);
    if (!usable.empty()) std::erase_if(near_, [&](std::int32_t k) { return usable[static_cast<std::size_t>(k)] == 0; });
    distance_.resize(near_.size());
    hamming_distances(query.descriptor, descriptors, near_, distance_.data());
    int distance = kFar;
    found[i] = pick_match(near_, distance_, keypoints, query.max_distance_bits, &distance);
    if (found[i] < 0) continue;
    const auto k = static_cast<std::size_t>(found[i]);
    if (distance < owner_distance_[k]) owner_distance_[k] = distance, owner_[k] = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < queries.size(); ++i)
    if (found[i] >= 0 && owner_[static_cast<std::size_t>(found[i])] != static_cast<int>(i)) found[i] = -1;
}

}  // namespace fbvins
