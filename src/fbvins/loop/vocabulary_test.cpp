// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/vocabulary.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/inverted_index.hpp"
#include "fbvins/loop/vocabulary_training.hpp"

namespace fbvins {
namespace vocabulary_test {

Descriptor random_descriptor(Rng& rng) {
  Descriptor d;
  for (auto& word : d.bits) word = (static_cast<std::uint64_t>(rng.next_u32()) << 32) | rng.next_u32();
  return d;
}

Descriptor flipped(Descriptor d, int bits, Rng& rng) {
  for (int i = 0; i < bits; ++i) d.bits[rng.below(4)] ^= std::uint64_t{1} << rng.below(64);
  return d;
}

/// Images whose descriptors are noisy copies of a few hundred prototypes.
std::vector<std::vector<Descriptor>> images(int count, std::uint64_t seed) {
  Rng prototypes_rng(99);
  std::vector<Descriptor> prototypes;
  for (int i = 0; i < 300; ++i) prototypes.push_back(random_descriptor(prototypes_rng));
  Rng rng(seed);
  std::vector<std::vector<Descriptor>> all(static_cast<std::size_t>(count));
  for (auto& image : all)
    for (int i = 0; i < 60; ++i) image.push_back(flipped(prototypes[rng.below(300)], 12, rng));
  return all;
}

const Vocabulary& trained() {
  static const Vocabulary v = train_vocabulary("orb", images(60, 1), {.branching = 6, .depth = 4, .min_members = 10});
  return v;
}

class VocabularyFile : public testing::Test {
 protected:
  // One file a process: tests run side by side.
  std::string path_ = (std::filesystem::temp_directory_path() / fmt::format("fbvins_vocabulary_{}.fbv", ::getpid())).string();
  void TearDown() override { std::filesystem::remove(path_); }
  std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put(const std::string& s) const { std::ofstream(path_, std::ios::binary) << s; }
};

TEST(Vocabulary, NoisyCopiesShareWordsAndStrangersDoNot) {
  const Vocabulary& v = trained();
  EXPECT_GT(v.words(), 150);
  Rng rng(5);
  std::vector<Descriptor> a = images(1, 7)[0], copy, stranger;
  for (const Descriptor& d : a) copy.push_back(flipped(d, 6, rng)), stranger.push_back(random_descriptor(rng));
  const BowVector words = v.words_of(a);
  EXPECT_NEAR(bow_similarity(words, words), 1.0, 1e-5);
  EXPECT_GT(bow_similarity(words, v.words_of(copy)), 0.5);
  EXPECT_LT(bow_similarity(words, v.words_of(stranger)), 0.3);
}

TEST(Vocabulary, TrainingRepeatsBitForBitAndDependsOnTheSeed) {
  const auto train = [](int seed) {
    return train_vocabulary("orb", images(20, 1), {.branching = 4, .depth = 3, .min_members = 10, .seed = seed});
  };
  const Vocabulary a = train(1), b = train(1), c = train(2);
  ASSERT_EQ(a.nodes().size(), b.nodes().size());
  EXPECT_TRUE(std::equal(a.descriptors().begin(), a.descriptors().end(), b.descriptors().begin()));
  EXPECT_FALSE(a.descriptors().size() == c.descriptors().size() &&
               std::equal(a.descriptors().begin(), a.descriptors().end(), c.descriptors().begin()));
}

TEST_F(VocabularyFile, SavedAndMappedGivesTheSameWords) {
  ASSERT_TRUE(trained().save(path_).ok());
  const auto mapped = Vocabulary::open(path_);
  ASSERT_TRUE(mapped.ok()) << mapped.error().message;
  EXPECT_EQ(mapped->kind(), "orb");
  EXPECT_EQ(mapped->words(), trained().words());
  const auto image = images(1, 3)[0];
  EXPECT_EQ(mapped->words_of(image), trained().words_of(image));
}

TEST_F(VocabularyFile, EveryDamageIsAnErrorWithASentence) {
  ASSERT_TRUE(trained().save(path_).ok());
  const std::string good = bytes();
  Rng rng(8);
  for (int i = 0; i < 300; ++i) {
    std::string bad = good;
    if (i % 3 == 0) bad.resize(rng.below(static_cast<std::uint32_t>(good.size())));
    else if (i % 3 == 1) bad[rng.below(static_cast<std::uint32_t>(good.size()))] ^= static_cast<char>(1u << rng.below(8));
    else bad[rng.below(64)] ^= static_cast<char>(1u << rng.below(8));
    put(bad);
    const auto opened = Vocabulary::open(path_);
    if (opened.ok()) {  // only the reserved bytes and the name of the kind carry nothing
      EXPECT_EQ(bad.substr(64), good.substr(64));
      EXPECT_EQ(opened->words(), trained().words());
    } else {
      EXPECT_NE(opened.error().message.find(path_), std::string::npos);
    }
  }
  EXPECT_EQ(Vocabulary::open(path_ + ".absent").error().code, ErrorCode::not_found);
}

TEST(InvertedIndex, AgreesWithComparingEveryPairAndForgetsWhatIsRemoved) {
  const Vocabulary& v = trained();
  const auto all = images(40, 11);
  InvertedIndex index(v.words());
  std::vector<BowVector> words;
  for (std::size_t i = 0; i < all.size(); ++i) {
    words.push_back(v.words_of(all[i]));
    index.add(KeyframeId{static_cast<std::int64_t>(i)}, words.back());
  }
  index.remove(KeyframeId{17}, words[17]);
  const BowVector query = v.words_of(images(1, 12)[0]);
  const auto hits = index.query(query, 100, [](KeyframeId k) { return k.value != 3; });
  EXPECT_EQ(hits.size(), 38u);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    EXPECT_NEAR(hits[i].similarity, bow_similarity(query, words[static_cast<std::size_t>(hits[i].keyframe.value)]), 1e-5);
    EXPECT_FALSE(hits[i].keyframe.value == 17 || hits[i].keyframe.value == 3);
    if (i > 0) {
      EXPECT_GE(hits[i - 1].similarity, hits[i].similarity);
    }
  }
}

}  // namespace vocabulary_test
}  // namespace fbvins
