// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_recogniser.hpp"

#include <gtest/gtest.h>

#include <set>

#include "fbvins/frontend/orb_starter.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace orb_recogniser_test {

/// Tracks of one image of the wall, remembered; then another image of the wall, from elsewhere.
struct Scene {
  TestWall wall;
  OrbDescriber describer{OrbOptions{}, make_identity_stage()};
  OrbImprover improver{make_identity_stage()};
  OrbView view;
  Pyramid left;
  OrbTracks tracks{60};
  FrontendStats stats;
  OrbRecogniser recogniser;
  std::vector<OrbTrack> before;

  explicit Scene(const RecognitionOptions& options = {}) : recogniser(wall.camera, options, OrbOptions{}.levels) {
    look(0, 1);
    OrbStarter(wall.camera, 15, 14).start(tracks, view, left, stats);
    for (OrbTrack& track : tracks) {
      track.inverse_depth = 1 / TestWall::kDepth_m;
      track.age_frames = 5;
      track.seen_from_G = Vec3::Zero();
    }
    before.assign(tracks.begin(), tracks.end());
  }
  void look(double x_m, std::uint64_t noise_seed) {
    const auto image = wall.render(x_m, noise_seed);
    left.build(image->view(), kOrbAlignmentLevels);
    describer.describe(image->view(), view);
    view.T_GC = Pose<G, C0>(Quat::Identity(), Vec3(x_m, 0, 0));
  }
  void end_all() {
    tracks.end_all(TrackStatus::out_of_view);
    tracks.drop_ended([&](const OrbTrack& t, const OrbPatches& p) { recogniser.remember(t, p.reference, view, view.t); });
  }
  /// Their positions on the wall, shifted by `off_m`.
  LandmarkUpdate update(const Vec3& off_m = Vec3::Zero()) const {
    LandmarkUpdate update;
    for (const OrbTrack& track : before)
      update.landmarks.push_back({track.id, TestWall::kDepth_m * Vec3(track.normalised.homogeneous()) + off_m});
    return update;
  }
};

TEST(OrbRecogniser, ReobservesTheWallFromAFewCentimetresAside) {
  for (const bool located_before_they_end : {true, false}) {
    Scene scene;
    if (located_before_they_end) scene.recogniser.locate(scene.update(), scene.tracks);
    scene.end_all();
    if (!located_before_they_end) scene.recogniser.locate(scene.update(), scene.tracks);
    for (const OrbTrack& track : scene.before) EXPECT_TRUE(scene.recogniser.remembers(track.id));
    scene.look(0.1, 2);
    scene.recogniser.recognise(scene.tracks, scene.view, scene.left, scene.improver, scene.stats);
    EXPECT_GT(scene.stats.recognised, 8);
    EXPECT_EQ(static_cast<std::size_t>(scene.stats.recognised), scene.tracks.size());
    for (const OrbTrack& track : scene.tracks) {
      const OrbTrack& then = scene.before[static_cast<std::size_t>(track.id.value)];
      EXPECT_LT((track.px - then.px - scene.wall.shift(0.1)).norm(), 0.5);
      EXPECT_EQ(track.age_frames, then.age_frames + 1);
      EXPECT_FALSE(scene.recogniser.remembers(track.id)) << "it is a track again";
    }
  }
}

TEST(OrbRecogniser, TakesNoneWhereTooFewAgree) {
  Scene scene;
  scene.end_all();
  LandmarkUpdate far_off = scene.update(Vec3(0.5, 0, 0));
  for (std::size_t i = 0; i < 3; ++i) far_off.landmarks[i].p_G.x() -= 0.5;
  scene.recogniser.locate(far_off, scene.tracks);
  scene.look(0.1, 2);
  scene.recogniser.recognise(scene.tracks, scene.view, scene.left, scene.improver, scene.stats);
  EXPECT_EQ(scene.stats.recognised, 0);
}

TEST(OrbRecogniser, RemembersLandmarksOnly) {
  Scene scene;
  scene.tracks[0].age_frames = 3;
  scene.tracks[1].inverse_depth.reset();
  scene.tracks[2].seen_from_G.reset();
  const std::set<TrackId> hardly{scene.tracks[0].id, scene.tracks[1].id, scene.tracks[2].id};
  scene.end_all();
  for (const OrbTrack& track : scene.before) EXPECT_NE(scene.recogniser.remembers(track.id), hardly.contains(track.id));
  scene.recogniser.clear(scene.tracks);
  for (const OrbTrack& track : scene.before) EXPECT_FALSE(scene.recogniser.remembers(track.id));

  Scene disabled(RecognitionOptions{.enabled = false});
  disabled.end_all();
  for (const OrbTrack& track : disabled.before) EXPECT_FALSE(disabled.recogniser.remembers(track.id));
}

}  // namespace orb_recogniser_test
}  // namespace fbvins
