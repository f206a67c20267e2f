// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/inverted_index.hpp"

#include <algorithm>

namespace fbvins {
namespace {

bool better(const IndexHit& a, const IndexHit& b) {
  return a.similarity != b.similarity ? a.similarity > b.similarity : a.keyframe < b.keyframe;
}

}  // namespace

void keep_best(std::vector<IndexHit>& hits, int most) {
  const auto kept = std::min<std::size_t>(hits.size(), static_cast<std::size_t>(std::max(most, 0)));
  std::ranges::partial_sort(hits, hits.begin() + static_cast<std::ptrdiff_t>(kept), better);
  hits.resize(kept);
}

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

std::size_t InvertedIndex::entries(std::int32_t word) const {
  const StoredWord* stored = store_ ? store_->find(word) : nullptr;
  return postings_[static_cast<std::size_t>(word)].size() + (stored == nullptr ? 0 : stored->keyframes);
}

std::size_t InvertedIndex::entries(const BowVector& bow) const {
  std::size_t sum = 0;
  for (const BowEntry& e : bow) sum += entries(e.word);
  return sum;
}

void InvertedIndex::score(const BowVector& bow) {
  for (const BowEntry& e : bow) {
    if (const StoredWord* stored = store_ ? store_->find(e.word) : nullptr; stored != nullptr)
      for (const WordPosting& p : store_->keyframes_with(*stored)) score_[p.slot] += std::min(e.weight, p.weight);
    for (const Posting& p : postings_[static_cast<std::size_t>(e.word)])
      score_[static_cast<std::size_t>(p.slot)] += std::min(e.weight, p.weight);
  }
}

/// Of the scores, which are zero afterwards. Only keyframes that are among the best so far are asked for.
std::vector<IndexHit> InvertedIndex::best(int most, const std::function<bool(KeyframeId)>& allowed) {
  std::vector<IndexHit> hits;  // a heap, the worst first
  for (std::size_t slot = 0; slot < score_.size() && most > 0; ++slot) {
    const IndexHit hit{keyframes_[slot], score_[slot]};
    const bool full = static_cast<int>(hits.size()) == most;
    if (hit.similarity == 0 || !hit.keyframe.valid() || (full && !better(hit, hits.front()))) continue;
    if (allowed && !allowed(hit.keyframe)) continue;
    if (full) std::ranges::pop_heap(hits, better), hits.pop_back();
    hits.push_back(hit);
    std::ranges::push_heap(hits, better);
  }
  std::ranges::sort_heap(hits, better);
  std::ranges::fill(score_, 0.0f);
  return hits;
}

std::vector<IndexHit> InvertedIndex::query(const BowVector& bow, int most, const std::function<bool(KeyframeId)>& allowed) {
  score(bow);
  return best(most, allowed);
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
  std::ranges::fill(score_, 0.0f);
  keep_best(hits, most);
  return hits;
}

std::vector<IndexHit> InvertedIndex::shortlist(const BowVector& bow, int most, std::size_t most_entries, std::size_t fewest_words,
                                               const std::function<bool(KeyframeId)>& allowed) {
  std::vector<std::pair<std::size_t, BowEntry>> rarest;
  for (const BowEntry& e : bow)
    if (const std::size_t n = entries(e.word); n > 0) rarest.emplace_back(n, e);
  std::ranges::stable_sort(rarest, {}, &std::pair<std::size_t, BowEntry>::first);
  BowVector some;
  std::size_t sum = 0;
  for (const auto& [n, e] : rarest) {
    sum += n;
    if (sum > most_entries && some.size() >= fewest_words) break;
    some.push_back(e);
  }
  return query(some, most, allowed);
}

}  // namespace fbvins
