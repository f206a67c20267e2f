// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_starter.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace orb_starter_test {

struct Scene {
  TestWall wall;
  OrbView view;
  Pyramid left;
  explicit Scene(const Image& image) {
    OrbDescriber(OrbOptions{}, make_identity_stage()).describe(image.view(), view);
    left.build(image.view(), kOrbAlignmentLevels);
  }
};

/// The wall has few sharp corners: the others of those wanted are started at poorer ones, at half the distance.
TEST(OrbStarter, StartsAsManyAsWantedWhereCornersArePoor) {
  const TestWall wall;
  Scene scene(*wall.render(0));
  OrbTracks tracks(200);
  FrontendStats stats;
  OrbStarter(wall.camera, 40, 14).start(tracks, scene.view, scene.left, stats);
  EXPECT_EQ(tracks.size(), 40u);
  EXPECT_EQ(stats.detected, 40);
  EXPECT_EQ(stats.tracked, 0);
  EXPECT_EQ(std::count(scene.view.used.begin(), scene.view.used.end(), 1), 40);
  for (const OrbTrack& a : tracks)
    for (const OrbTrack& b : tracks) EXPECT_TRUE(a.id == b.id || (a.px - b.px).norm() >= 7) << a.id.value;
}

TEST(OrbStarter, StartsNothingWhereATrackIsOrAKeypointIsTaken) {
  const TestWall wall;
  Scene scene(*wall.render(0));
  OrbTracks tracks(200);
  FrontendStats stats;
  OrbStarter starter(wall.camera, 60, 14);
  for (std::size_t k = 0; k < scene.view.used.size(); ++k)
    scene.view.used[k] = scene.view.features.keypoints[k].pixel.x() < TestWall::kWidth / 2;
  starter.start(tracks, scene.view, scene.left, stats);
  const std::size_t in_right_half = tracks.size();
  EXPECT_GT(in_right_half, 10u);
  for (const OrbTrack& track : tracks) EXPECT_GE(track.px.x(), TestWall::kWidth / 2);
  scene.view.used.assign(scene.view.used.size(), 0);
  starter.start(tracks, scene.view, scene.left, stats);
  EXPECT_EQ(stats.tracked, static_cast<int>(in_right_half));
  EXPECT_LE(tracks.size(), 60u);
  for (const OrbTrack& a : tracks)
    for (const OrbTrack& b : tracks) EXPECT_TRUE(a.id == b.id || (a.px - b.px).norm() >= 7) << a.id.value;
}

TEST(OrbStarter, StopsWhenTheTableIsFull) {
  const TestWall wall;
  Scene scene(*wall.render(0));
  OrbTracks tracks(5);
  FrontendStats stats;
  OrbStarter(wall.camera, 40, 14).start(tracks, scene.view, scene.left, stats);
  EXPECT_EQ(tracks.size(), 5u);
}

}  // namespace orb_starter_test
}  // namespace fbvins
