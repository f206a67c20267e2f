// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/inverted_index.hpp"

#include <algorithm>

namespace fbvins {
namespace {

bool better(const IndexHit& a, const IndexHit& b) {
  return a.similarity != b.similarity ? a.similarity > b.similarity : a.keyframe < b.keyframe;
}

}  // namespace

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

void InvertedIndex::add(std::shared_ptr<PlaceStore> store) {
  store_ = std::move(store);
  slots_.reserve(store_->size());
  for (std::size_t slot = 0; slot < store_->size(); ++slot) take_slot(store_->at(slot).keyframe);
}

void InvertedIndex::add(KeyframeId keyframe, const BowVector& bow) {
  const std::int32_t slot = take_slot(keyframe);
  for (const BowEntry& e : bow) postings_[static_cast<std::size_t>(e.word)].push_back({slot, e.weight});
}

void InvertedIndex::remove(KeyframeId keyframe, const BowVector& bow) {
  const auto known = slots_.find(keyframe);
  if (known == slots_.end()) return;
  const std::int32_t slot = known->second;
  slots_.erase(known);
  if (store_ && static_cast<std::size_t>(slot) < store_->size()) {  // still in the file's lists
    keyframes_[static_cast<std::size_t>(slot)] = {};
    return;
  }
  for (const BowEntry& e : bow)
    std::erase_if(postings_[static_cast<std::size_t>(e.word)], [&](const Posting& p) { return p.slot == slot; });
  free_.push_back(slot);
}

void InvertedIndex::count(std::int32_t slot, float weight) {
  float& score = score_[static_cast<std::size_t>(slot)];
  if (score == 0) touched_.push_back(slot);
  score += weight;
}

void InvertedIndex::score(const BowVector& bow) {
  for (const BowEntry& e : bow) {
    if (store_)
      for (const WordPosting& p : store_->postings(e.word))
        count(static_cast<std::int32_t>(p.slot), std::min(e.weight, p.weight));
    for (const Posting& p : postings_[static_cast<std::size_t>(e.word)]) count(p.slot, std::min(e.weight, p.weight));
  }
}

void InvertedIndex::forget_scores() {
  for (const std::int32_t slot : touched_) score_[static_cast<std::size_t>(slot)] = 0;
  touched_.clear();
}

std::vector<IndexHit> InvertedIndex::query(const BowVector& bow, int most, const std::function<bool(KeyframeId)>& allowed) {
  score(bow);
  std::vector<IndexHit> found, hits;
  found.reserve(touched_.size());
  for (const std::int32_t slot : touched_)
    if (const KeyframeId keyframe = keyframes_[static_cast<std::size_t>(slot)]; keyframe.valid())
      found.push_back({keyframe, score_[static_cast<std::size_t>(slot)]});
  forget_scores();
  // Only the first ones are put in order, and asked for.
  const auto worse = [](const IndexHit& a, const IndexHit& b) { return better(b, a); };
  std::ranges::make_heap(found, worse);
  while (!found.empty() && static_cast<int>(hits.size()) < most) {
    std::ranges::pop_heap(found, worse);
    if (!allowed || allowed(found.back().keyframe)) hits.push_back(found.back());
    found.pop_back();
  }
  return hits;
}

std::vector<IndexHit> InvertedIndex::query(const BowVector& bow, int most, std::span<const KeyframeId> among) {
  if (among.empty()) return {};
  score(bow);
  std::vector<IndexHit> hits;
  for (const KeyframeId keyframe : among) {
    const auto slot = slots_.find(keyframe);
    const float similarity = slot == slots_.end() ? 0 : score_[static_cast<std::size_t>(slot->second)];
    if (similarity > 0) hits.push_back({keyframe, similarity});
  }
  forget_scores();
  const auto kept = std::min<std::size_t>(hits.size(), static_cast<std::size_t>(std::max(most, 0)));
  std::ranges::partial_sort(hits, hits.begin() + static_cast<std::ptrdiff_t>(kept), better);
  hits.resize(kept);
  return hits;
}

}  // namespace fbvins
