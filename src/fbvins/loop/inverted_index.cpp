// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/inverted_index.hpp"

#include <algorithm>

namespace fbvins {

std::int32_t InvertedIndex::take_slot(KeyframeId keyframe) {
  const auto [known, is_new] = slots_.try_emplace(keyframe, static_cast<std::int32_t>(keyframes_.size()));
  if (!is_new) return known->second;
  if (free_.empty()) {
    keyframes_.push_back(keyframe);
    score_.push_back(0);
  } else {
    known->second = free_.back();
    free_.pop_back();
    keyframes_[static_cast<std::size_t>(known->second)] = keyframe;
  }
  return known->second;
}

void InvertedIndex::add(KeyframeId keyframe, const BowVector& bow) {
  const std::int32_t slot = take_slot(keyframe);
  for (const BowEntry& e : bow) postings_[static_cast<std::size_t>(e.word)].push_back({slot, e.weight});
}

void InvertedIndex::remove(KeyframeId keyframe, const BowVector& bow) {
  const auto known = slots_.find(keyframe);
  if (known == slots_.end()) return;
  const std::int32_t slot = known->second;
  for (const BowEntry& e : bow)
    std::erase_if(postings_[static_cast<std::size_t>(e.word)], [&](const Posting& p) { return p.slot == slot; });
  free_.push_back(slot);
  slots_.erase(known);
}

std::vector<IndexHit> InvertedIndex::query(const BowVector& bow, int most, const std::function<bool(KeyframeId)>& allowed) {
  touched_.clear();
  for (const BowEntry& e : bow)
    for (const Posting& p : postings_[static_cast<std::size_t>(e.word)]) {
      float& score = score_[static_cast<std::size_t>(p.slot)];
      if (score == 0) touched_.push_back(p.slot);
      score += std::min(e.weight, p.weight);
    }
  std::vector<IndexHit> hits;
  hits.reserve(touched_.size());
  for (const std::int32_t slot : touched_) {
    float& score = score_[static_cast<std::size_t>(slot)];
    const KeyframeId keyframe = keyframes_[static_cast<std::size_t>(slot)];
    if (!allowed || allowed(keyframe)) hits.push_back({keyframe, score});
    score = 0;
  }
  const auto better = [](const IndexHit& a, const IndexHit& b) {
    return a.similarity != b.similarity ? a.similarity > b.similarity : a.keyframe < b.keyframe;
  };
  const auto kept = std::min<std::size_t>(hits.size(), static_cast<std::size_t>(std::max(most, 0)));
  std::partial_sort(hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(kept), hits.end(), better);
  hits.resize(kept);
  return hits;
}

}  // namespace fbvins
