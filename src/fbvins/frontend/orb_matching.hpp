// SPDX-License-Identifier: Apache-2.0
// Guided matching: descriptors of tracks against the keypoints near where each track is expected.
// Buffers are reused; one instance, one thread.
//
//   GuidedMatcher matcher(options);
//   matcher.index(752, 480, features.keypoints);
//   matcher.match(queries, features, found);        // found[i]: keypoint of queries[i], or -1
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fbvins/features/hamming.hpp"
#include "fbvins/features/keypoint.hpp"

namespace fbvins {

struct GuidedMatchOptions {
  int max_distance = 60;
  double max_ratio = 0.85;
  double rival_px = 4.0;
  int max_level_difference = 1;

  template <class V>
  void visit(V&& v) {
    v("max_distance", max_distance, "bit", "largest Hamming distance of a match", 1, 256);
    v("max_ratio", max_ratio, "", "largest ratio of the best to the second-best distance", 0.1, 1.0);
    v("rival_px", rival_px, "px", "keypoints closer than this show the same corner and are no rivals", 0.0, 20.0);
    v("max_level_difference", max_level_difference, "", "levels of the scale pyramid a match may be apart", 0, 12);
  }
};

struct GuidedQuery {
  Vec2 px = Vec2::Zero();  ///< where the track is expected
  double radius_px = 10;
  int level = 0;
  int max_distance = 60;  ///< bits
  Descriptor descriptor;
};

class GuidedMatcher {
 public:
  explicit GuidedMatcher(const GuidedMatchOptions& options) : options_(options) {}

  void index(int width, int height, std::span<const Keypoint> keypoints);
  /// found[i] is the keypoint that matches query i best, within ratio and mutually, or -1.
  void match(std::span<const GuidedQuery> queries, const OrbFeatures& features, std::vector<int>& found);

 private:
  void candidates_near(const GuidedQuery& query, std::span<const Keypoint> keypoints);

  GuidedMatchOptions options_;
  int columns_ = 0, rows_ = 0;
  std::vector<std::int32_t> cell_start_, members_;  // keypoints by cell, cell_start_[c] .. cell_start_[c + 1]
  std::vector<std::int32_t> near_;
  std::vector<std::uint16_t> distance_;
  std::vector<int> owner_, owner_distance_;  // best query of each keypoint
};

/// Best of the candidates if it passes distance and ratio; rivals are those more than rival_px away. -1 if none.
int pick_match(std::span<const std::int32_t> candidates, std::span<const std::uint16_t> distances,
               std::span<const Keypoint> keypoints, int max_distance, double max_ratio, double rival_px, int* distance);

}  // namespace fbvins
