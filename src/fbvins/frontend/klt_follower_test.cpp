// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_follower.hpp"

#include <gtest/gtest.h>

#include "fbvins/features/shi_tomasi.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace klt_follower_test {

/// A corner of the wall, followed from one image into the next, which `second` shows.
struct Scene {
  TestWall wall;
  FrameImages images{wall.rig(), kKltLevels};
  KltFollower follower{wall.camera};
  KltTrack track;
  std::unique_ptr<KltPatches> patches = std::make_unique<KltPatches>();
  FrontendStats stats;

  Scene() {
    take(wall.render(0, 1));
    ShiTomasiDetector detector(22);
    for (const Corner& corner : detector.detect(images.left(), {}, 20))
      if ((corner.px - Vec2(120, 90)).norm() < (track.px - Vec2(120, 90)).norm()) track.px = corner.px;
    track.normalised = wall.camera.undistort(track.px).value();
    track.inverse_depth = 1 / TestWall::kDepth_m;
    patches->newest.cut(images.left(), track.px, 0, kKltLevels - 1);
    follower.set_reference(track, *patches, images.left());
    images.advance();
  }
  void take(std::shared_ptr<const Image> left) {
    StereoFrame frame;
    frame.set_image(0, std::move(left));
    images.take(frame, stats);
  }
  bool follow(const CameraMotion& motion) { return follower.follow(track, *patches, motion, 0, images, stats); }
};

TEST(KltFollower, FindsTheFeatureWithAndWithoutAPrediction) {
  for (const bool predicted : {true, false}) {
    Scene scene;
    const Vec2 before = scene.track.px;
    scene.take(scene.wall.render(0.06, 2));
    ASSERT_TRUE(scene.follow(predicted ? scene.wall.motion(0.06) : CameraMotion{}));
    EXPECT_LT((scene.track.px - before - scene.wall.shift(0.06)).norm(), 0.2);
    EXPECT_EQ(scene.track.previous_px, before);
    EXPECT_EQ(scene.track.age_frames, 1);
    EXPECT_DOUBLE_EQ(*scene.track.inverse_depth, 1 / TestWall::kDepth_m);
  }
}

TEST(KltFollower, LosesWhatIsNotThere) {
  Scene dark;
  dark.take(std::make_shared<const Image>(TestWall::kWidth, TestWall::kHeight, std::uint8_t{90}));
  EXPECT_FALSE(dark.follow({}));
  EXPECT_EQ(dark.stats.lost_flow, 1);

  Scene elsewhere;
  elsewhere.take(elsewhere.wall.render(5, 2));  // another piece of the wall
  EXPECT_FALSE(elsewhere.follow({}));
}

TEST(KltFollower, UpdatesTheDepthByTheMotion) {
  Scene scene;
  scene.take(scene.wall.render(0, 2));
  CameraMotion ahead;  // does not show in the image: the wall looks the same
  ahead.has_rotation = ahead.has_translation = true;
  ahead.p_ba = Vec3(0, 0, -0.03);
  ASSERT_TRUE(scene.follow(ahead));
  EXPECT_NEAR(1 / *scene.track.inverse_depth, TestWall::kDepth_m - 0.03, 1e-9);
  EXPECT_NEAR(1 / *scene.track.previous_inverse_depth, TestWall::kDepth_m, 1e-9);
  EXPECT_NEAR(scene.track.depth_ratio, (TestWall::kDepth_m - 0.03) / TestWall::kDepth_m, 1e-9);
}

}  // namespace klt_follower_test
}  // namespace fbvins
