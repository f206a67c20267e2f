// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/inverted_index.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace inverted_index_test {

constexpr int kWords = 50;

/// Words of one image, weights of sum 1.
BowVector image(Rng& rng) {
  BowVector bow;
  float sum = 0;
  for (std::int32_t w = 0; w < kWords; ++w)
    if (rng.below(3) == 0) bow.push_back({w, static_cast<float>(rng.uniform(0.1, 1))}), sum += bow.back().weight;
  for (BowEntry& e : bow) e.weight /= sum;
  return bow;
}

TEST(InvertedIndex, AgreesWithComparingWithEveryImage) {
  Rng rng(1);
  InvertedIndex index(kWords);
  std::vector<BowVector> images;
  for (int i = 0; i < 40; ++i) images.push_back(image(rng)), index.add(KeyframeId{i}, images.back());
  const BowVector query = image(rng);
  const auto hits = index.query(query, 100);
  ASSERT_EQ(hits.size(), 40u);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    EXPECT_NEAR(hits[i].similarity, bow_similarity(query, images[static_cast<std::size_t>(hits[i].keyframe.value)]), 1e-5);
    EXPECT_EQ(hits[i].similarity, bow_similarity(query, images[static_cast<std::size_t>(hits[i].keyframe.value)]));
    EXPECT_GE(hits[i == 0 ? 0 : i - 1].similarity, hits[i].similarity);
  }
  EXPECT_EQ(index.query(query, 3).size(), 3u);
  EXPECT_EQ(index.query(query, 3)[0].keyframe, hits[0].keyframe) << "a query leaves no state behind";
}

TEST(InvertedIndex, AShortlistIsOfTheRarestWords) {
  InvertedIndex index(kWords);
  for (int id = 0; id < 20; ++id) index.add(KeyframeId{id}, {{1, 0.5f}, {2 + id % 4, 0.5f}, {10 + id, 0.5f}});
  const BowVector query{{1, 0.5f}, {2, 0.5f}, {13, 0.5f}};
  EXPECT_EQ(index.entries(query), 26u);
  const auto all = [](KeyframeId) { return true; };
  EXPECT_EQ(index.shortlist(query, 100, 26, 1, all).size(), 20u);
  EXPECT_EQ(index.shortlist(query, 100, 6, 1, all).size(), 6u);
  EXPECT_EQ(index.shortlist(query, 100, 5, 1, all).size(), 1u);
  EXPECT_EQ(index.shortlist(query, 100, 5, 2, all).size(), 6u) << "of the fewest words in any case";
  EXPECT_EQ(index.shortlist(query, 3, 6, 1, all)[0].keyframe, KeyframeId{0});
  EXPECT_EQ(index.shortlist(query, 100, 5, 1, [](KeyframeId k) { return k.value != 3; }).size(), 0u);
}

TEST(InvertedIndex, EqualOnesComeInOrderOfId) {
  InvertedIndex index(kWords);
  for (const int id : {7, 2, 5}) index.add(KeyframeId{id}, {{3, 1.0f}});
  const auto hits = index.query({{3, 1.0f}}, 10);
  ASSERT_EQ(hits.size(), 3u);
  EXPECT_EQ(hits[0].keyframe, KeyframeId{2});
  EXPECT_EQ(hits[1].keyframe, KeyframeId{5});
  EXPECT_EQ(hits[2].keyframe, KeyframeId{7});
}

TEST(InvertedIndex, MemoryDoesNotGrowWithTheIdsOfAFile) {
  InvertedIndex index(kWords);
  constexpr std::int64_t kLargest = (std::int64_t{1} << 62) - 1;
  for (const std::int64_t id : {std::int64_t{5}, kLargest}) index.add(KeyframeId{id}, {{3, 1.0f}});
  index.remove(KeyframeId{5}, {{3, 1.0f}});
  index.add(KeyframeId{kLargest - 1}, {{3, 0.5f}});
  const auto hits = index.query({{3, 1.0f}}, 10);
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_EQ(hits[0].keyframe, KeyframeId{kLargest});
  EXPECT_EQ(hits[1].keyframe, KeyframeId{kLargest - 1});
}

TEST(InvertedIndex, LeavesOutWhatIsNotAllowedOrNotThere) {
  InvertedIndex index(kWords);
  const BowVector words{{1, 0.5f}, {4, 0.5f}};
  for (int id = 0; id < 3; ++id) index.add(KeyframeId{id}, words);
  index.remove(KeyframeId{1}, words);
  const auto hits = index.query(words, 10, [](KeyframeId k) { return k != KeyframeId{0}; });
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].keyframe, KeyframeId{2});
  EXPECT_TRUE(index.query({{9, 1.0f}}, 10).empty());
  EXPECT_TRUE(index.query({}, 10).empty());
}

}  // namespace inverted_index_test
}  // namespace fbvins
