// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_track.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace orb_track_test {

OrbTrack track_at(const Camera& camera, const Vec2& px, int age_frames = 5) {
  OrbTrack track;
  track.px = px;
  track.normalised = camera.undistort(px).value();
  track.age_frames = age_frames;
  return track;
}

TEST(OrbTrack, IsPredictedByItsDepthAndEndsOutsideTheImage) {
  const TestWall wall;
  OrbTracks tracks(3);
  OrbTrack with_depth = track_at(wall.camera, Vec2(100, 90));
  with_depth.inverse_depth = 1 / wall.kDepth_m;
  tracks.start(with_depth);
  tracks.start(track_at(wall.camera, Vec2(100, 50)));  // taken as far away
  tracks.start(track_at(wall.camera, Vec2(2, 90)));
  tracks[2].inverse_depth = 1 / 0.5;
  predict(tracks, wall.camera, wall.motion(0.3), 0);
  EXPECT_NEAR((tracks[0].px - Vec2(100, 90) - wall.shift(0.3)).norm(), 0, 1e-9);
  EXPECT_EQ(tracks[1].px, Vec2(100, 50));
  EXPECT_EQ(tracks[0].previous_px, Vec2(100, 90));
  EXPECT_TRUE(tracks[0].was_observed && !tracks[0].observed);
  EXPECT_EQ(tracks[0].status, TrackStatus::active);
  EXPECT_EQ(tracks[2].status, TrackStatus::out_of_view) << "120 px to the left of the image";
}

TEST(OrbTrack, CarriesItsDepthAndRemembersThatOfTheImageBefore) {
  const TestWall wall;
  OrbTracks tracks(1);
  tracks.start(track_at(wall.camera, Vec2(100, 90)));
  tracks[0].inverse_depth = 0.5;
  CameraMotion ahead;
  ahead.has_rotation = ahead.has_translation = true;
  ahead.p_ba = Vec3(0, 0, -0.1);
  predict(tracks, wall.camera, ahead, 0);
  EXPECT_NEAR(1 / *tracks[0].inverse_depth, 1.9, 1e-9);
  EXPECT_EQ(tracks[0].previous_inverse_depth, 0.5);
}

TEST(OrbTrack, IsLostBehindTheCamera) {
  const TestWall wall;
  OrbTracks tracks(1);
  tracks.start(track_at(wall.camera, Vec2(100, 90)));
  tracks[0].inverse_depth = 1;
  CameraMotion through;
  through.has_rotation = through.has_translation = true;
  through.p_ba = Vec3(0, 0, -0.95);
  predict(tracks, wall.camera, through, 0);
  EXPECT_EQ(tracks[0].status, TrackStatus::lost);
}

TEST(OrbTrack, RemembersInWhichOfTheLastImagesItWasObserved) {
  OrbTrack track;
  for (const std::int64_t image : {10, 11, 12}) {
    track.normalised = Vec2(static_cast<double>(image), 0);
    track.observed = image != 11;
    track.see(image);
  }
  ASSERT_NE(track.position_in(10), nullptr);
  EXPECT_EQ(track.position_in(10)->x(), 10);
  EXPECT_EQ(track.position_in(11), nullptr);
  EXPECT_EQ(track.position_in(12 - static_cast<std::int64_t>(OrbTrack::kHistory)), nullptr) << "overwritten";
}

TEST(OrbTrack, SettlesInsideTheImageOnly) {
  const TestWall wall;
  OrbView view;
  view.t = Time{7};
  view.T_GC = Pose<G, C0>(Quat::Identity(), Vec3(1, 2, 3));
  OrbTrack track = track_at(wall.camera, Vec2(100, 90));
  track.observed = false;
  EXPECT_FALSE(set_observed(track, Vec2(kPatchBorder_px - 1, 90), wall.camera, view));
  EXPECT_FALSE(track.observed);
  EXPECT_TRUE(set_observed(track, Vec2(110, 95), wall.camera, view));
  EXPECT_TRUE(track.observed);
  EXPECT_EQ(track.age_frames, 6);
  EXPECT_EQ(track.last_seen, view.t);
  EXPECT_EQ(*track.seen_from_G, Vec3(1, 2, 3));
}

TEST(ThinOut, KeepsTheOlderOfTwoThatHaveComeTogetherAndNoMoreThanWanted) {
  const TestWall wall;
  OrbTracks tracks(5);
  tracks.start(track_at(wall.camera, Vec2(100, 90), 1));
  tracks.start(track_at(wall.camera, Vec2(103, 90), 9));  // 4 px are 0.4 of the smallest distance
  tracks.start(track_at(wall.camera, Vec2(50, 90), 3));
  tracks.start(track_at(wall.camera, Vec2(104.5, 94), 2));
  tracks.start(track_at(wall.camera, Vec2(105, 90), 8));
  tracks[4].observed = false;
  thin_out(tracks, 2, 10);
  tracks.drop_ended();
  ASSERT_EQ(tracks.size(), 3u);
  EXPECT_EQ(tracks[0].age_frames, 9);
  EXPECT_EQ(tracks[1].age_frames, 8) << "tracks that are not observed are not thinned out";
  EXPECT_EQ(tracks[2].age_frames, 3);
}

TEST(ThinOut, LosesNoLocatedLandmark) {
  const TestWall wall;
  OrbTracks tracks(3);
  for (int age_frames = 1; age_frames <= 3; ++age_frames)
    tracks.start(track_at(wall.camera, Vec2(100 + age_frames, 90), age_frames));
  tracks[0].p_G = Vec3(1, 2, 3);
  thin_out(tracks, 5, 10);
  EXPECT_EQ(tracks[0].status, TrackStatus::active) << "the oldest";
  EXPECT_EQ(tracks[1].status, TrackStatus::lost);
  EXPECT_EQ(tracks[2].status, TrackStatus::out_of_view);
}

TEST(Forget, KeepsTracksWithDepthForLonger) {
  const TestWall wall;
  const Time now{2'000'000'000};
  const auto status = [&](double seen_ago_s, bool depth, int age_frames, bool observed = false) {
    OrbTracks tracks(1);
    OrbTrack track = track_at(wall.camera, Vec2(100, 90), age_frames);
    track.observed = observed;
    track.last_seen = now - Duration::from_seconds(seen_ago_s);
    if (depth) track.inverse_depth = 0.3;
    tracks.start(track);
    forget(tracks, now, 1.0);
    return tracks[0].status;
  };
  EXPECT_EQ(status(0.9, true, 5), TrackStatus::active);
  EXPECT_EQ(status(1.1, true, 5), TrackStatus::out_of_view);
  EXPECT_EQ(status(0.2, false, 5), TrackStatus::active);
  EXPECT_EQ(status(0.4, false, 5), TrackStatus::out_of_view);
  EXPECT_EQ(status(0.1, true, 1), TrackStatus::out_of_view) << "seen once only";
  EXPECT_EQ(status(1.1, true, 5, true), TrackStatus::active) << "observed";
}

}  // namespace orb_track_test
}  // namespace fbvins
