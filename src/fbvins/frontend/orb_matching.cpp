// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fbvins {
namespace {

constexpr int kCell_px = 16;
constexpr int kFar = 257;

}  // namespace

void GuidedMatcher::index(int width, int height, std::span<const Keypoint> keypoints) {
  columns_ = width / kCell_px + 1;
  rows_ = height / kCell_px + 1;
  cell_start_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  members_.resize(keypoints.size());
  const auto cell = [&](const Keypoint& k) {
    const int x = std::clamp(static_cast<int>(k.pixel.x()) / kCell_px, 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>(k.pixel.y()) / kCell_px, 0, rows_ - 1);
    return static_cast<std::size_t>(y * columns_ + x);
  };
  for (const Keypoint& k : keypoints) ++cell_start_[cell(k) + 1];
  for (std::size_t c = 1; c < cell_start_.size(); ++c) cell_start_[c] += cell_start_[c - 1];
  owner_.assign(cell_start_.begin(), cell_start_.end() - 1);  // next free place of each cell
  for (std::size_t i = 0; i < keypoints.size(); ++i)
    members_[static_cast<std::size_t>(owner_[cell(keypoints[i])]++)] = static_cast<std::int32_t>(i);
}

void GuidedMatcher::candidates_near(const GuidedQuery& query, std::span<const Keypoint> keypoints) {
  near_.clear();
  const auto cell = [](double v, int count) {
    return static_cast<int>(std::clamp(std::floor(v / kCell_px), 0.0, static_cast<double>(count - 1)));
  };
  const int x0 = cell(query.px.x() - query.radius_px, columns_), x1 = cell(query.px.x() + query.radius_px, columns_);
  const int y0 = cell(query.px.y() - query.radius_px, rows_), y1 = cell(query.px.y() + query.radius_px, rows_);
  const double radius2 = query.radius_px * query.radius_px;
  for (int y = y0; y <= y1; ++y) {
    const std::int32_t first = cell_start_[static_cast<std::size_t>(y * columns_ + x0)];
    const std::int32_t last = cell_start_[static_cast<std::size_t>(y * columns_ + x1) + 1];
    for (std::int32_t i = first; i < last; ++i) {
      const std::int32_t k = members_[static_cast<std::size_t>(i)];
      const Keypoint& keypoint = keypoints[static_cast<std::size_t>(k)];
      if (std::abs(keypoint.level - query.level) > options_.max_level_difference) continue;
      if ((keypoint.pixel - query.px).squaredNorm() <= radius2) near_.push_back(k);
    }
  }
}

void GuidedMatcher::match(std::span<const GuidedQuery> queries, const OrbFeatures& features, std::vector<int>& found) {
  found.assign(queries.size(), -1);
  owner_.assign(features.size(), -1);
  owner_distance_.assign(features.size(), kFar);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const GuidedQuery& query = queries[i];
    candidates_near(query, features.keypoints);
    distance_.resize(near_.size());
    hamming_distances(query.descriptor, features.descriptors, near_, distance_.data());
    int distance = kFar;
    found[i] =
        pick_match(near_, distance_, features.keypoints, query.max_distance, options_.max_ratio, options_.rival_px, &distance);
    if (found[i] < 0) continue;
    const auto k = static_cast<std::size_t>(found[i]);
    if (distance < owner_distance_[k]) owner_distance_[k] = distance, owner_[k] = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < queries.size(); ++i)
    if (found[i] >= 0 && owner_[static_cast<std::size_t>(found[i])] != static_cast<int>(i)) found[i] = -1;
}

int pick_match(std::span<const std::int32_t> candidates, std::span<const std::uint16_t> distances,
               std::span<const Keypoint> keypoints, int max_distance, double max_ratio, double rival_px, int* distance) {
  int best = -1, first = kFar;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (distances[i] < first) first = distances[i], best = candidates[i];
  if (best < 0 || first > max_distance) return -1;
  int second = kFar;
  const Keypoint& winner = keypoints[static_cast<std::size_t>(best)];
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Keypoint& rival = keypoints[static_cast<std::size_t>(candidates[i])];
    const double same = rival_px * std::max(rival.scale, winner.scale);
    if ((rival.pixel - winner.pixel).squaredNorm() > same * same) second = std::min<int>(second, distances[i]);
  }
  if (second < kFar && !(first < max_ratio * second)) return -1;
  *distance = first;
  return best;
}

}  // namespace fbvins
