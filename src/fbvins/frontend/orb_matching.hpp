// SPDX-License-Identifier: Apache-2.0
// Guided matching: descriptors of tracks against the keypoints near where each track is expected.
// Buffers are reused; one instance, one thread.
//
//   GuidedMatcher matcher;
//   matcher.match(queries, {features.keypoints, features.descriptors}, grid, found);        // found[i]: keypoint of queries[i],
//   or -1
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fbvins/features/hamming.hpp"
#include "fbvins/features/keypoint.hpp"
#include "fbvins/frontend/keypoint_grid.hpp"

namespace fbvins {

/// Largest Hamming distance of a match over time, bits; the same for descriptors as extracted and for improved ones.
inline constexpr int kMatchDistance_bits = 60;
/// Largest ratio of the best to the second-best distance.
inline constexpr double kMatchRatio = 0.85;
/// Keypoints closer than this, times the scale of their level, are of the same corner and do not count in the ratio test.
inline constexpr double kRival_px = 4.0;

struct GuidedQuery {
  Vec2 px = Vec2::Zero();  ///< where the track is expected
  double radius_px = 10;
  int level = 0;
  int max_distance_bits = kMatchDistance_bits;
  Descriptor descriptor = {};
  Descriptor raw = {};  ///< the same as extracted
};

/// What queries are compared with.
struct MatchCandidates {
  std::span<const Keypoint> keypoints;
  std::span<const Descriptor> descriptors;
  std::span<const std::uint8_t> usable = {};  ///< which of them; empty: all
};

class GuidedMatcher {
 public:
  /// found[i] is the keypoint that matches query i best, within ratio and mutually, or -1.
  void match(std::span<const GuidedQuery> queries, const MatchCandidates& candidates, const KeypointGrid& grid,
             std::vector<int>& found);

 private:
  std::vector<std::int32_t> near_;
  std::vector<std::uint16_t> distance_;
  std::vector<int> owner_, owner_distance_;  // best query of each keypoint
};

}  // namespace fbvins
