// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_outlier_check.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace orb_outlier_check_test {

/// Sixty points of a room; the camera moves to the right by a centimetre per image. The first point slides across the epipolar
/// lines by a third of the threshold per image.
TEST(OrbOutlierCheck, FindsASlowSlideOverSeveralImages) {
  constexpr double kFocal_px = 400, kThreshold_px = 1.0;
  Rng rng(3);
  std::vector<Vec3> points;
  for (int i = 0; i < 60; ++i) points.emplace_back(rng.uniform(-2, 2), rng.uniform(-1.5, 1.5), rng.uniform(3, 6));
  OrbTracks tracks(60);
  for (std::size_t i = 0; i < points.size(); ++i) tracks.start({});
  const Camera camera(PinholeRadtan{.fx = kFocal_px, .fy = kFocal_px, .cx = 320, .cy = 240}, 640, 480);
  OrbOutlierCheck check(camera, 0.11, kThreshold_px);
  MotionPredictor predictor(Pose<B, C0>{});
  OrbView view;
  FrontendStats stats;
  for (view.index = 0; view.index < 6; ++view.index) {
    view.t = Time{view.index * 50'000'000};
    ImuSegment still;
    for (int k = 0; k <= 10; ++k) still.samples.push_back({view.t + Duration{k * 5'000'000}, Vec3::Zero(), Vec3(0, 0, 9.81)});
    predictor.add(still, StatePrior{});
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const double slid_px = i == 0 ? kThreshold_px / 3 * static_cast<double>(view.index) : 0;
      tracks[i].normalised =
          (points[i] - Vec3(0.01 * static_cast<double>(view.index), 0, 0)).hnormalized() + Vec2(0, slid_px / kFocal_px);
    }
    check.begin(view);
    check.judge(tracks, view, predictor, stats);
    if (view.index < 5) {
      EXPECT_EQ(stats.lost_epipolar, 0) << view.index;
    }
  }
  EXPECT_EQ(stats.lost_epipolar, 1);
  EXPECT_EQ(tracks[0].status, TrackStatus::lost);
}

}  // namespace orb_outlier_check_test
}  // namespace fbvins
