// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/keypoint_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace keypoint_grid_test {

TEST(KeypointGrid, FindsTheSameAsAnExhaustiveSearch) {
  Rng rng(3);
  std::vector<Keypoint> keypoints(300);
  for (Keypoint& k : keypoints) {
    k.pixel = Vec2(rng.uniform(0, 200), rng.uniform(0, 100));
    k.level = static_cast<int>(rng.below(4));
  }
  KeypointGrid grid;
  grid.build(200, 100, keypoints);
  std::vector<std::int32_t> found;
  std::size_t all = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const Vec2 px(rng.uniform(-30, 230), rng.uniform(-30, 130));  // outside as well
    const double radius_px = rng.uniform(1, 40);
    const int level = static_cast<int>(rng.below(4));
    grid.near(px, radius_px, level, keypoints, found);
    std::sort(found.begin(), found.end());
    std::vector<std::int32_t> wanted;
    for (std::size_t i = 0; i < keypoints.size(); ++i)
      if ((keypoints[i].pixel - px).norm() <= radius_px && std::abs(keypoints[i].level - level) <= 1)
        wanted.push_back(static_cast<std::int32_t>(i));
    EXPECT_EQ(found, wanted);
    all += wanted.size();
  }
  EXPECT_GT(all, 500u);
}

TEST(KeypointGrid, CanBeBuiltAgainAndOfNothing) {
  KeypointGrid grid;
  std::vector<Keypoint> keypoints(1);
  keypoints[0].pixel = Vec2(50, 50);
  std::vector<std::int32_t> found;
  grid.build(100, 100, keypoints);
  grid.near(Vec2(50, 50), 5, 0, keypoints, found);
  EXPECT_EQ(found.size(), 1u);
  grid.build(100, 100, {});
  grid.near(Vec2(50, 50), 5, 0, {}, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace keypoint_grid_test
}  // namespace fbvins
