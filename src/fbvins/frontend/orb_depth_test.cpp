// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_depth.hpp"

#include <gtest/gtest.h>

#include "fbvins/frontend/orb_starter.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace orb_depth_test {

constexpr double kDisparity_px = TestWall::kFocal_px * TestWall::kBaseline_m / TestWall::kDepth_m;

/// Tracks started in the left image of the wall, then looked for in the right one.
struct Scene {
  TestWall wall;
  FrameImages images{wall.rig(), kOrbAlignmentLevels};
  OrbView view;
  OrbTracks tracks{60};
  FrontendStats stats;

  OrbDepth match(const OrbFrontendOptions& options) {
    OrbDescriber describer(OrbOptions{}, make_identity_stage());
    StereoFrame frame;
    frame.set_image(0, wall.render(0, 1));
    frame.set_image(1, wall.render(TestWall::kBaseline_m, 2));
    images.take(frame, stats);
    describer.describe(frame.left()->view(), view);
    OrbStarter(wall.camera, 40, 14).start(tracks, view, images.left(), stats);
    OrbDepth depth(wall.rig(), options);
    depth.match(tracks, images, stats);
    return depth;
  }
};

TEST(OrbDepth, IsThatOfTheWall) {
  Scene scene;
  const OrbDepth depth = scene.match({});
  EXPECT_GT(scene.stats.stereo, 15);
  EXPECT_NEAR(depth.typical_inverse_depth(), 1 / TestWall::kDepth_m, 0.01);
  for (const OrbTrack& track : scene.tracks) {
    EXPECT_EQ(track.right.has_value(), track.inverse_depth.has_value());
    if (!track.right) continue;
    EXPECT_NEAR((track.px - track.right->pixel).x(), kDisparity_px, 0.5);
    EXPECT_NEAR(*track.inverse_depth, 1 / TestWall::kDepth_m, 0.03);
  }
}

TEST(OrbDepth, NothingIsFoundNearerThanLookedFor) {
  Scene scene;
  (void)scene.match({.min_depth_m = 2 * TestWall::kDepth_m});
  EXPECT_EQ(scene.stats.stereo, 0);
}

}  // namespace orb_depth_test
}  // namespace fbvins
