// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/inverted_index.hpp"

#include <algorithm>

namespace fbvins {

void InvertedIndex::add(KeyframeId keyframe, const BowVector& bow) {
  const auto id = static_cast<std::int32_t>(keyframe.value);
  for (const BowEntry& e : bow) postings_[static_cast<std::size_t>(e.word)].push_back({id, e.weight});
  if (score_.size() <= static_cast<std::size_t>(id)) score_.resize(static_cast<std::size_t>(id) + 1, 0.0f);
}

void InvertedIndex::remove(KeyframeId keyframe, const BowVector& bow) {
  for (const BowEntry& e : bow)
    std::erase_if(postings_[static_cast<std::size_t>(e.word)], [&](const Posting& p) { return p.keyframe == keyframe.value; });
}

std::vector<IndexHit> InvertedIndex::query(const BowVector& bow, int most, const std::function<bool(KeyframeId)>& allowed) {
  touched_.clear();
  for (const BowEntry& e : bow)
    for (const Posting& p : postings_[static_cast<std::size_t>(e.word)]) {
      float& score = score_[static_cast<std::size_t>(p.keyframe)];
      if (score == 0) touched_.push_back(p.keyframe);
      score += std::min(e.weight, p.weight);
    }
  std::vector<IndexHit> hits;
  hits.reserve(touched_.size());
  for (const std::int32_t k : touched_) {
    float& score = score_[static_cast<std::size_t>(k)];
    if (!allowed || allowed(KeyframeId{k})) hits.push_back({KeyframeId{k}, score});
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
