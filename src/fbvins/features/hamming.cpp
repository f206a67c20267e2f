// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/hamming.hpp"

#include <bit>

#include "fbvins/core/simd.hpp"

namespace fbvins {

FBVINS_KERNEL
static void distances_indexed(const std::uint64_t* query, const std::uint64_t* train, const std::int32_t* indices,
                              std::size_t count, std::uint16_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t* t = train + 4 * static_cast<std::size_t>(indices[i]);
    int n = 0;
    for (int w = 0; w < 4; ++w) n += std::popcount(query[w] ^ t[w]);
    out[i] = static_cast<std::uint16_t>(n);
  }
}

FBVINS_KERNEL
static void distances_all(const std::uint64_t* query, const std::uint64_t* train, std::size_t count, std::uint16_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    int n = 0;
    for (int w = 0; w < 4; ++w) n += std::popcount(query[w] ^ train[4 * i + w]);
    out[i] = static_cast<std::uint16_t>(n);
  }
}

void hamming_distances(const Descriptor& query, std::span<const Descriptor> train, std::span<const std::int32_t> indices,
                       std::uint16_t* out) {
  if (!train.empty()) distances_indexed(query.bits.data(), train[0].bits.data(), indices.data(), indices.size(), out);
}

void hamming_distances(const Descriptor& query, std::span<const Descriptor> train, std::uint16_t* out) {
  if (!train.empty()) distances_all(query.bits.data(), train[0].bits.data(), train.size(), out);
}

std::vector<DescriptorMatch> match_descriptors(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                               const HammingOptions& options) {
  constexpr int kFar = 257;
  std::vector<std::uint16_t> row(b.size());
  std::vector<int> best_a(b.size(), -1), best_a_distance(b.size(), kFar);
  std::vector<DescriptorMatch> found, kept;
  for (std::size_t i = 0; i < a.size(); ++i) {
    hamming_distances(a[i], b, row.data());
    int best = -1, first = kFar, second = kFar;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int d = row[j];
      if (d < best_a_distance[j]) best_a_distance[j] = d, best_a[j] = static_cast<int>(i);
      if (d < first) second = first, first = d, best = static_cast<int>(j);
      else if (d < second) second = d;
    }
    if (best >= 0 && first <= options.max_distance && first < options.max_ratio * second)
      found.push_back({static_cast<int>(i), best, first});
  }
  for (const DescriptorMatch& m : found)
    if (!options.mutual || best_a[static_cast<std::size_t>(m.b)] == m.a) kept.push_back(m);
  return kept;
}

}  // namespace fbvins
