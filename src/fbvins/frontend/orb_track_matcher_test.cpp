// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_track_matcher.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/frontend/orb_starter.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace orb_track_matcher_test {

/// Makes all descriptors the same: improved ones are useless here, those as extracted are not.
class Leveller final : public DescriptorStage {
 public:
  void improve(int, int, OrbFeatures& features) override {
    for (Descriptor& d : features.descriptors) d = Descriptor{};
  }
  bool changes_descriptors() const override { return true; }
};

struct Scene {
  TestWall wall;
  OrbView view;
  OrbTracks tracks{60};
  FrontendStats stats;
  OrbImprover improver;

  explicit Scene(const std::shared_ptr<DescriptorStage>& stage) : improver(stage) {
    OrbDescriber describer(OrbOptions{}, stage);
    const auto before = wall.render(0, 1), now = wall.render(0.05, 2);
    Pyramid left;
    left.build(before->view(), kOrbAlignmentLevels);
    describer.describe(before->view(), view);
    OrbStarter(wall.camera, 30, 14).start(tracks, view, left, stats);
    for (OrbTrack& track : tracks) track.inverse_depth = 1 / TestWall::kDepth_m;
    describer.describe(now->view(), view);
    predict(tracks, wall.camera, wall.motion(0.05), 0);
  }
};

TEST(OrbTrackMatcher, FindsTracksWhereTheyAreExpected) {
  Scene scene(make_identity_stage());
  OrbTrackMatcher matcher(12);
  const std::vector<int> found = matcher.match(scene.tracks, scene.view, true, scene.improver, scene.stats);
  int matched = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    ++matched;
    const Vec2 px = scene.view.features.keypoints[static_cast<std::size_t>(found[i])].pixel;
    EXPECT_LT((px - scene.tracks[i].px).norm(), 12);
    scene.tracks[i].observed = true;
  }
  EXPECT_GT(matched, 10);
  EXPECT_EQ(scene.stats.matches.found, matched);
  EXPECT_EQ(scene.stats.raw_matches.found, matched) << "nothing was improved";
  scene.tracks[0].status = TrackStatus::lost;
  scene.tracks.drop_ended();
  matcher.count_inliers(scene.tracks, scene.stats);
  EXPECT_GT(scene.stats.matches.inliers, matched / 2);
  EXPECT_EQ(scene.stats.raw_matches.inliers, scene.stats.matches.inliers);
}

TEST(OrbTrackMatcher, AlsoCountsMatchesOfDescriptorsAsExtracted) {
  Scene scene(std::make_unique<Leveller>());
  OrbTrackMatcher matcher(12);
  (void)matcher.match(scene.tracks, scene.view, true, scene.improver, scene.stats);
  EXPECT_GT(scene.stats.raw_matches.found, 10);
  EXPECT_LT(scene.stats.matches.found, scene.stats.raw_matches.found) << "equal descriptors fail the ratio test";
}

/// Of a track that alignment has found, the keypoint at its position is enough: nothing is improved for it.
TEST(OrbTrackMatcher, ImprovesWhatLostTracksResembleOnly) {
  Scene scene(std::make_unique<Leveller>());
  OrbTrackMatcher matcher(12);
  for (OrbTrack& track : scene.tracks) track.observed = true;
  const std::vector<int> followed = matcher.match(scene.tracks, scene.view, true, scene.improver, scene.stats);
  const auto improved = [&] { return std::count(scene.view.improved.begin(), scene.view.improved.end(), 1); };
  EXPECT_GT(std::count_if(followed.begin(), followed.end(), [](int k) { return k >= 0; }), 10);
  EXPECT_EQ(improved(), 0);
  EXPECT_EQ(scene.stats.matches.found, 0) << "none was lost";
  for (OrbTrack& track : scene.tracks) {
    EXPECT_TRUE(track.unimproved);
    track.observed = track.id.value > 0;
  }
  (void)matcher.match(scene.tracks, scene.view, true, scene.improver, scene.stats);
  EXPECT_GT(improved(), 0);
  EXPECT_LT(improved(), 10);
  for (const OrbTrack& track : scene.tracks) EXPECT_EQ(track.unimproved, track.observed);
}

}  // namespace orb_track_matcher_test
}  // namespace fbvins
