// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/motion_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace motion_check_test {

struct Track : TrackState {};
struct Patches {};

constexpr double kFocal_px = 450, kNoise_px = 0.2, kDt_s = 0.05;
const Camera kPinhole(PinholeRadtan{.fx = kFocal_px, .fy = kFocal_px, .cx = 376, .cy = 240}, 752, 480);

/// Points two to six metres away before a camera that flies sideways at 0.4 m/s; the first ones are on something that walks.
struct Crowd {
  CameraMotion motion;
  TrackTable<Track, Patches> tracks{100};
  int walking;

  Crowd(int points, int walkers, double walking_mps) : walking(walkers) {
    motion.R_ba = so3_exp(Vec3(0.01, -0.02, 0.005)).toRotationMatrix();
    motion.p_ba = Vec3(-0.4 * kDt_s, 0, 0.005);
    motion.has_rotation = motion.has_translation = true;
    Rng rng(11);
    for (int i = 0; i < points; ++i) {
      const double x = rng.uniform(-2, 2), y = rng.uniform(-1.5, 1.5);
      const Vec3 p(x, y, rng.uniform(2, 6));
      const Vec3 walked = p + Vec3(i < walking ? walking_mps * kDt_s : 0, 0, 0);
      const double noise_x = rng.normal(), noise_y = rng.normal();
      Track track;
      track.previous_normalised = p.hnormalized();
      track.normalised = (motion.R_ba * walked + motion.p_ba).hnormalized() + kNoise_px / kFocal_px * Vec2(noise_x, noise_y);
      track.previous_inverse_depth = 1 / p.z();
      tracks.start(track);
    }
  }
  /// How many of the first and of the others are lost.
  std::pair<int, int> lost(const CameraMotion& predicted) {
    MotionCheck check(kPinhole, 0.11);
    FrontendStats stats;
    check.collect(tracks, [](const Track& track) { return &track.previous_normalised; });
    check.judge(tracks, predicted, kDt_s, stats);
    std::pair<int, int> out{0, 0};
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (tracks[i].status == TrackStatus::lost) ++(static_cast<int>(i) < walking ? out.first : out.second);
    EXPECT_EQ(stats.lost_check, out.first + out.second);
    return out;
  }
};

TEST(MotionCheck, FindsAMajorityThatMovesTogether) {
  Crowd crowd(100, 55, 0.8);
  CameraMotion predicted = crowd.motion;
  predicted.p_ba += 0.01 * kDt_s * Vec3(1, -1, 1);
  predicted.R_ba = so3_exp(Vec3(5e-4, 5e-4, -5e-4)).toRotationMatrix() * predicted.R_ba;
  const auto [walking, still] = crowd.lost(predicted);
  EXPECT_EQ(walking, 55);
  EXPECT_EQ(still, 0);
}

TEST(MotionCheck, CorrectsSmallErrorsOfThePrediction) {
  Crowd crowd(100, 0, 0);
  CameraMotion predicted = crowd.motion;
  predicted.R_ba = so3_exp(Vec3(2e-3, -2e-3, 0)).toRotationMatrix() * predicted.R_ba;  // more than a pixel
  EXPECT_EQ(crowd.lost(predicted).second, 0);
}

TEST(MotionCheck, RejectsNoneWhereFewTracksAgreeWithTheState) {
  Crowd crowd(100, 0, 0);
  CameraMotion predicted = crowd.motion;
  predicted.p_ba += Vec3(0.05, 0, 0);  // a metre a second too fast
  EXPECT_EQ(crowd.lost(predicted).second, 0);
}

TEST(MotionCheck, NeedsAStateAndEnoughTracks) {
  Crowd crowd(100, 30, 0.8);
  CameraMotion rotation_only = crowd.motion;
  rotation_only.has_translation = false;
  EXPECT_EQ(crowd.lost(rotation_only).first, 0);
  Crowd few(15, 5, 0.8);
  EXPECT_EQ(few.lost(few.motion).first, 0);
}

TEST(MotionCheck, LeavesOutTracksWithoutDepth) {
  Crowd crowd(100, 30, 0.8);
  crowd.tracks[0].previous_inverse_depth.reset();
  EXPECT_EQ(crowd.lost(crowd.motion).first, 29);
}

/// The depth that counts is that of the image before; towards the edge of the image the newest one's would be wrong by pixels.
TEST(MotionCheck, KeepsWhatStandsStillInFastFlightAhead) {
  TrackTable<Track, Patches> tracks(100);
  CameraMotion ahead;
  ahead.has_rotation = ahead.has_translation = true;
  ahead.p_ba = Vec3(0, 0, -2 * kDt_s);
  Rng rng(13);
  for (int i = 0; i < 60; ++i) {
    const double x = rng.uniform(-0.7, 0.7), y = rng.uniform(-0.5, 0.5), depth_m = rng.uniform(1, 2);
    Track track;
    track.previous_normalised = Vec2(x, y);
    track.previous_inverse_depth = 1 / depth_m;
    track.normalised = (depth_m * Vec3(x, y, 1) + ahead.p_ba).hnormalized();
    track.inverse_depth = 1 / (depth_m + ahead.p_ba.z());
    tracks.start(track);
  }
  MotionCheck check(kPinhole, 0.11);
  FrontendStats stats;
  check.collect(tracks, [](const Track& track) { return &track.previous_normalised; });
  check.judge(tracks, ahead, kDt_s, stats);
  EXPECT_EQ(stats.lost_check, 0);
}

/// Towards the edge of a wide lens a pixel is a long way in the plane of normalised coordinates.
TEST(MotionCheck, MeasuresInPixelsOfTheLens) {
  const Camera fisheye(KannalaBrandt{.fx = 250, .fy = 250, .cx = 376, .cy = 240}, 752, 480);
  TrackTable<Track, Patches> tracks(100);
  Rng rng(12);
  for (int i = 0; i < 60; ++i) {
    const double angle = rng.uniform(0, 2 * std::numbers::pi), radius_px = rng.uniform(0, 330);
    const double noise_x = rng.normal(), noise_y = rng.normal();
    const Vec2 px = Vec2(376, 240) + radius_px * Vec2(std::cos(angle), std::sin(angle));
    Track track;
    track.previous_normalised = *fisheye.undistort(px);
    track.normalised = *fisheye.undistort(px + kNoise_px * Vec2(noise_x, noise_y));
    track.previous_inverse_depth = 0.3;
    tracks.start(track);
  }
  CameraMotion still;
  still.has_rotation = still.has_translation = true;
  MotionCheck check(fisheye, 0.11);
  FrontendStats stats;
  check.collect(tracks, [](const Track& track) { return &track.previous_normalised; });
  check.judge(tracks, still, kDt_s, stats);
  EXPECT_EQ(stats.lost_check, 0);
}

}  // namespace motion_check_test
}  // namespace fbvins
