// SPDX-License-Identifier: Apache-2.0
// The keypoints of an image by grid cell, so that those near a point are found without a search through all.
// Buffers are reused; reading it is safe from several threads.
//
//   KeypointGrid grid;
//   grid.build(752, 480, features.keypoints);
//   grid.near(px, 12, 1, features.keypoints, found);      // of levels 0 to 2
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fbvins/features/keypoint.hpp"

namespace fbvins {

class KeypointGrid {
 public:
  void build(int width, int height, std::span<const Keypoint> keypoints);
  /// Fills `out` with the keypoints within the radius and at most one pyramid level from `level`; `keypoints` as in build().
  void near(const Vec2& px, double radius_px, int level, std::span<const Keypoint> keypoints,
            std::vector<std::int32_t>& out) const;

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<std::int32_t> cell_start_, members_;  // keypoints by cell, cell_start_[c] .. cell_start_[c + 1]
  std::vector<std::int32_t> next_;                  // free place of each cell, while it is built
};

}  // namespace fbvins
