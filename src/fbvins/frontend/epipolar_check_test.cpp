// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/epipolar_check.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace epipolar_check_test {

/// Forty points of a room, seen before and after a step to the right; every fifth has moved by itself, up.
std::vector<TrackState> tracks_with_outliers() {
  Rng rng(5);
  std::vector<TrackState> tracks(40);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Vec3 p(rng.uniform(-2, 2), rng.uniform(-1.5, 1.5), rng.uniform(3, 6));
    tracks[i].previous_normalised = p.hnormalized();
    tracks[i].normalised = (p - Vec3(0.3, 0, 0)).hnormalized();
    if (i % 5 == 0) tracks[i].normalised.y() += 0.05;
  }
  return tracks;
}

const Vec2* before(const TrackState& track) { return &track.previous_normalised; }

TEST(EpipolarCheck, LosesThoseThatMovedByThemselves) {
  std::vector<TrackState> tracks = tracks_with_outliers();
  EpipolarCheck check(400, 1);
  check.collect(tracks, before);
  EXPECT_EQ(check.gathered(), tracks.size());
  FrontendStats stats;
  const EpipolarResult result = check.judge(tracks, Mat3(Mat3::Identity()), 1.0, stats);
  EXPECT_EQ(stats.lost_epipolar, 8);
  EXPECT_EQ(result.inliers, 32);
  for (std::size_t i = 0; i < tracks.size(); ++i) EXPECT_EQ(tracks[i].status == TrackStatus::lost, i % 5 == 0) << i;
}

TEST(EpipolarCheck, JudgesOnlyThoseGatheredAndNoneThatHasEnded) {
  std::vector<TrackState> tracks = tracks_with_outliers();
  EpipolarCheck check(400, 1);
  tracks[5].status = TrackStatus::out_of_view;
  check.collect(tracks, [&](const TrackState& track) { return &track == &tracks[0] ? nullptr : before(track); });
  EXPECT_EQ(check.gathered(), tracks.size() - 2);
  FrontendStats stats;
  (void)check.judge(tracks, Mat3(Mat3::Identity()), 1.0, stats);
  EXPECT_EQ(stats.lost_epipolar, 6);
  EXPECT_EQ(tracks[0].status, TrackStatus::active);
  EXPECT_EQ(tracks[5].status, TrackStatus::out_of_view);
}

}  // namespace epipolar_check_test
}  // namespace fbvins
