// SPDX-License-Identifier: Apache-2.0
// Matching of 256-bit descriptors by Hamming distance. Pure functions.
//
//   for (const DescriptorMatch& m : match_descriptors(a.descriptors, b.descriptors, {})) pair(m.a, m.b);
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fbvins/features/keypoint.hpp"

namespace fbvins {

/// out[i] = distance of query to train[indices[i]].
void hamming_distances(const Descriptor& query, std::span<const Descriptor> train, std::span<const std::int32_t> indices,
                       std::uint16_t* out);

/// out[i] = distance of query to train[i].
void hamming_distances(const Descriptor& query, std::span<const Descriptor> train, std::uint16_t* out);

struct HammingOptions {
  int max_distance = 64;    ///< bits
  double max_ratio = 0.85;  ///< best over second-best distance
  bool mutual = true;       ///< each is the other's best
};

struct DescriptorMatch {
  int a = 0, b = 0, distance = 0;
};

/// Every descriptor of a against every one of b, in order of a.
std::vector<DescriptorMatch> match_descriptors(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                               const HammingOptions& options);

}  // namespace fbvins
