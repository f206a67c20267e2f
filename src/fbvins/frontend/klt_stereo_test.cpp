// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_stereo.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "fbvins/geometry/so3.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace klt_stereo_test {

/// The wall, seen by a pair whose right camera is turned about its axis.
struct TurnedPair {
  explicit TurnedPair(double angle_rad) : angle(angle_rad), rig(wall.rig()) {
    rig.cameras[1].T_BC.q = so3_exp(Vec3(0, 0, angle_rad));
    left.build(wall.render(0, 1)->view(), kLevels);
    right.build(turned_image().view(), kLevels);
  }
  static constexpr int kLevels = 4;

  /// What the right camera shows: a pixel of its image is where the image of a camera that is not turned has it.
  Image turned_image() const {
    const Vec2 centre(120, 90), shift = TestWall::shift(-TestWall::kBaseline_m);
    const auto warp = [&](const Vec2& px) { return Vec2(centre + Eigen::Rotation2Dd(angle) * Vec2(px - centre) + shift); };
    return render_texture(TestWall::kWidth, TestWall::kHeight, wall.texture, warp, 120, 35, 1.0, 2);
  }

  /// Share of a grid of features that is matched, each at the wall's depth.
  double share_matched(const StereoRig& assumed, std::optional<double> inverse_depth, bool search = true) const {
    KltStereoMatcher matcher(assumed, 0.35);
    int tried = 0, matched = 0;
    for (int y = 50; y <= 130; y += 16)
      for (int x = 80; x <= 160; x += 16) {
        const Vec2 px(x, y);
        KltTemplate patch;
        if (!patch.cut(left, px, 0, kLevels - 1)) continue;
        ++tried;
        const StereoMatch match = matcher.match(patch, px, *rig.left().undistort(px), inverse_depth, left, right, search);
        if (match.failure != StereoFailure::none) continue;
        ++matched;
        EXPECT_NEAR(match.inverse_depth, 1 / TestWall::kDepth_m, 0.02) << px.transpose();
      }
    EXPECT_GT(tried, 20);
    return static_cast<double>(matched) / tried;
  }

  TestWall wall;
  double angle;
  StereoRig rig;
  Pyramid left, right;
};

TEST(KltStereo, MatchesImagesThatAreTurned) {
  for (const double angle : {0.0, 0.6, std::numbers::pi / 2, std::numbers::pi, -2.0}) {
    const TurnedPair pair(angle);
    EXPECT_GT(pair.share_matched(pair.rig, std::nullopt), 0.9) << angle;
    EXPECT_GT(pair.share_matched(pair.rig, 0.3), 0.9) << "from a depth, " << angle;
  }
}

TEST(KltStereo, WithoutSearchOnlyTheGivenDepthIsTried) {
  for (const double angle : {0.0, std::numbers::pi}) {
    const TurnedPair pair(angle);
    EXPECT_EQ(pair.share_matched(pair.rig, std::nullopt, false), 0) << angle;
    EXPECT_GT(pair.share_matched(pair.rig, 1 / TestWall::kDepth_m, false), 0.9) << angle;
  }
}

TEST(KltStereo, NewTracksAreSearchedForAndOthersInOneImageOfFour) {
  TrackState track;
  int searched = 0;
  for (track.age_frames = 2; track.age_frames < 42; ++track.age_frames) searched += searches_line(track);
  EXPECT_EQ(searched, 10);
  track.age_frames = 0;
  EXPECT_TRUE(searches_line(track));
}

TEST(KltStereo, NothingMatchesWhereTheTurnIsNotKnown) {
  const TurnedPair pair(std::numbers::pi / 2);
  EXPECT_LT(pair.share_matched(pair.wall.rig(), std::nullopt), 0.1);
}

}  // namespace klt_stereo_test
}  // namespace fbvins
