// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_locator.hpp"

#include <gtest/gtest.h>

#include "fbvins/frontend/orb_starter.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace orb_locator_test {

constexpr double kStep_m = 0.04;

/// Tracks started in one image of the wall, and predicted into the next.
struct Scene {
  TestWall wall;
  FrameImages images{wall.rig(), kOrbAlignmentLevels};
  OrbView view;
  OrbTracks tracks{60};
  FrontendStats stats;
  std::vector<Vec2> started_px;

  Scene() {
    OrbDescriber describer(OrbOptions{}, make_identity_stage());
    for (const double x_m : {0.0, kStep_m}) {
      StereoFrame frame;
      frame.set_image(0, wall.render(x_m, x_m > 0 ? 2 : 1));
      images.take(frame, stats);
      describer.describe(frame.left()->view(), view);
      if (x_m > 0) break;
      OrbStarter(wall.camera, 30, 14).start(tracks, view, images.left(), stats);
      for (OrbTrack& track : tracks) {
        started_px.push_back(track.px);
        track.inverse_depth = 1 / TestWall::kDepth_m;
      }
      images.advance();
    }
    predict(tracks, wall.camera, wall.motion(kStep_m), 0);
  }
  /// No track has a keypoint: only alignment is left.
  std::vector<int> no_keypoints() const { return std::vector<int>(tracks.size(), -1); }
  std::vector<double> errors_px() const {
    std::vector<double> errors;
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (tracks[i].observed) errors.push_back((tracks[i].px - started_px[i] - wall.shift(kStep_m)).norm());
    return errors;
  }
};

TEST(OrbLocator, FollowsTracksWithoutAKeypointByAlignment) {
  Scene scene;
  const std::size_t all = scene.tracks.size();
  OrbLocator(scene.wall.camera).follow(scene.tracks, scene.view, scene.images, scene.stats);
  const std::vector<double> errors = scene.errors_px();
  EXPECT_GT(errors.size(), all * 3 / 4);
  for (const double error : errors) EXPECT_LT(error, 0.3);
  EXPECT_EQ(scene.stats.lost_flow, static_cast<int>(all - errors.size()));
}

TEST(OrbLocator, LocatesByKeypointsOnly) {
  Scene scene;
  OrbLocator(scene.wall.camera).locate(scene.tracks, scene.view, scene.images, scene.no_keypoints(), scene.stats);
  EXPECT_TRUE(scene.errors_px().empty());
}

TEST(OrbLocator, RefinesAKeypointAndTakesItsDescriptor) {
  Scene scene;
  std::vector<int> found = scene.no_keypoints();
  int near = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t k = 0; k < scene.view.features.size(); ++k)
      if ((scene.view.features.keypoints[k].pixel - scene.tracks[i].px).norm() < 1.5 && found[i] < 0)
        found[i] = static_cast<int>(k), ++near;
  ASSERT_GT(near, 10);
  OrbLocator(scene.wall.camera).locate(scene.tracks, scene.view, scene.images, found, scene.stats);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0 || !scene.tracks[i].observed) continue;
    EXPECT_EQ(scene.tracks[i].descriptor, scene.view.descriptor(static_cast<std::size_t>(found[i])));
    EXPECT_EQ(scene.view.used[static_cast<std::size_t>(found[i])], 1);
  }
  for (const double error : scene.errors_px()) EXPECT_LT(error, 0.3);
}

TEST(OrbLocator, AKeypointOfSomethingElseIsNotTaken) {
  Scene scene;
  std::vector<int> found = scene.no_keypoints();
  for (std::size_t k = 0; k < scene.view.features.size() && found[0] < 0; ++k)
    if ((scene.view.features.keypoints[k].pixel - scene.tracks[0].px).norm() > 40) found[0] = static_cast<int>(k);
  ASSERT_GE(found[0], 0);
  OrbLocator(scene.wall.camera).locate(scene.tracks, scene.view, scene.images, found, scene.stats);
  EXPECT_FALSE(scene.tracks[0].observed);
  EXPECT_EQ(scene.stats.lost_check, 1);
}

}  // namespace orb_locator_test
}  // namespace fbvins
