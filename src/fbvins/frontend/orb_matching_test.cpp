// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_matching.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace orb_matching_test {

/// A descriptor with this many bits set.
Descriptor bits(int count) {
  Descriptor d;
  for (int i = 0; i < count; ++i) d.bits[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  return d;
}

struct Scene {
  OrbFeatures features;
  KeypointGrid grid;
  void add(const Vec2& px, int distance_bits) {
    features.keypoints.push_back({.pixel = px});
    features.descriptors.push_back(bits(distance_bits));
    grid.build(200, 100, features.keypoints);
  }
  std::vector<int> match(const std::vector<GuidedQuery>& queries) {
    std::vector<int> found;
    GuidedMatcher().match(queries, {features.keypoints, features.descriptors}, grid, found);
    return found;
  }
};

TEST(GuidedMatcher, TakesTheBestWithinRadiusAndDistance) {
  Scene scene;
  scene.add(Vec2(50, 50), 30);
  scene.add(Vec2(58, 50), 10);
  scene.add(Vec2(90, 50), 0);  // too far away
  EXPECT_EQ(scene.match({{.px = Vec2(52, 50)}}), std::vector<int>{1});
  EXPECT_EQ(scene.match({{.px = Vec2(52, 50), .max_distance_bits = 9}}), std::vector<int>{-1});
  EXPECT_EQ(scene.match({{.px = Vec2(150, 50)}}), std::vector<int>{-1});
}

TEST(GuidedMatcher, ASecondBestNearlyAsGoodFailsTheRatioTestUnlessItIsTheSameCorner) {
  Scene apart;
  apart.add(Vec2(50, 50), 20);
  apart.add(Vec2(57, 50), 22);
  EXPECT_EQ(apart.match({{.px = Vec2(52, 50)}}), std::vector<int>{-1});
  Scene same;
  same.add(Vec2(50, 50), 20);
  same.add(Vec2(53, 50), 22);
  EXPECT_EQ(same.match({{.px = Vec2(52, 50)}}), std::vector<int>{0});
}

TEST(GuidedMatcher, AKeypointBelongsToTheMostSimilarTrack) {
  Scene scene;
  scene.add(Vec2(50, 50), 20);
  const GuidedQuery far{.px = Vec2(52, 50)}, near{.px = Vec2(48, 50), .descriptor = bits(15)};
  EXPECT_EQ(scene.match({far, near}), (std::vector<int>{-1, 0}));
  EXPECT_EQ(scene.match({near, far}), (std::vector<int>{0, -1}));
}

}  // namespace orb_matching_test
}  // namespace fbvins
