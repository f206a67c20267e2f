// SPDX-License-Identifier: Apache-2.0
// How long a query of the inverted index takes as the map grows: synthetic keyframes of 500 descriptors, each a random node of
// the vocabulary with some bits flipped.
//
//   loop_index [VOCABULARY]
#include <fmt/format.h>

#include <chrono>

#include "fbvins/core/rng.hpp"
#include "fbvins/core/stage_timer.hpp"
#include "fbvins/loop/inverted_index.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

using namespace fbvins;

int main(int argc, char** argv) {
  const auto start = std::chrono::steady_clock::now();
  const auto vocabulary = Vocabulary::open(argc > 1 ? argv[1] : shipped_vocabulary());
  if (!vocabulary) {
    fmt::print(stderr, "{}\n", vocabulary.error().message);
    return 2;
  }
  fmt::print("opened {} words in {:.1f} ms\n", vocabulary->words(),
             std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  Rng rng(1);
  const auto centres = vocabulary->descriptors();
  const auto keyframe = [&] {
    std::vector<Descriptor> d;
    for (int i = 0; i < 500; ++i) {
      Descriptor x = centres[1 + rng.below(static_cast<std::uint32_t>(centres.size() - 1))];
      for (int b = 0; b < 20; ++b) x.bits[rng.below(4)] ^= std::uint64_t{1} << rng.below(64);
      d.push_back(x);
    }
    return vocabulary->words_of(d);
  };
  InvertedIndex index(vocabulary->words());
  for (int n = 0; n <= 20000; ++n) {
    if (n == 1000 || n == 5000 || n == 10000 || n == 20000) {
      constexpr int kQueries = 50;
      std::vector<BowVector> queries;
      for (int i = 0; i < kQueries; ++i) queries.push_back(keyframe());
      CpuTimer timer;
      std::size_t hits = 0;
      for (const BowVector& q : queries) hits += index.query(q, 40).size();
      fmt::print("{:6d} keyframes: {:.3f} ms a query ({} hits)\n", n, timer.lap_ms() / kQueries, hits);
    }
    index.add(KeyframeId{n}, keyframe());
  }
  return 0;
}
