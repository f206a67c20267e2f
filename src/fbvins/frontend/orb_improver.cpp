// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_improver.hpp"

#include <algorithm>

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {
namespace {

/// Descriptors as extracted that are farther apart than this hardly ever match after they were improved: unrelated ones are 128
/// bits apart, 20 less or more.
constexpr int kSimilar_bits = 110;
/// Keypoints of an image that are improved, the most similar ones: its work is bounded.
constexpr std::ptrdiff_t kMostImproved = 96;

}  // namespace

void OrbImprover::improve_similar(std::span<const GuidedQuery> queries, OrbView& view) {
  if (!view.improves) return;
  similar_.clear();
  for (const GuidedQuery& query : queries) {
    view.grid.near(query.px, query.radius_px, query.level, view.features.keypoints, near_);
    distance_.resize(near_.size());
    hamming_distances(query.raw, view.features.descriptors, near_, distance_.data());
    for (std::size_t i = 0; i < near_.size(); ++i) {
      const auto k = static_cast<std::size_t>(near_[i]);
      if (distance_[i] > kSimilar_bits || view.improved[k] != 0) continue;
      similar_.push_back({distance_[i], near_[i]});
    }
  }
  take_most_similar(view);
  if (inputs_.empty()) return;
  run(view);
  for (std::size_t i = 0; i < keypoints_.size(); ++i) view.descriptors[static_cast<std::size_t>(keypoints_[i])] = descriptors_[i];
}

/// Each keypoint once.
void OrbImprover::take_most_similar(OrbView& view) {
  inputs_.clear();
  keypoints_.clear();
  std::ranges::sort(similar_);
  auto left = kMostImproved - std::ranges::count(view.improved, 1);
  for (const auto& [distance, keypoint] : similar_) {
    const auto k = static_cast<std::size_t>(keypoint);
    if (view.improved[k] != 0) continue;
    if (left-- <= 0) return;
    view.improved[k] = 1;
    keypoints_.push_back(keypoint);
    inputs_.push_back(view.input(k));
  }
}

void OrbImprover::run(const OrbView& view) {
  CpuTimer timer;
  descriptors_.resize(inputs_.size());
  stage_->improve(view.context, inputs_, descriptors_);
  ms_ += timer.lap_ms();
}

}  // namespace fbvins
