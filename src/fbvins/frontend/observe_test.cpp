// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/observe.hpp"

#include <gtest/gtest.h>

#include "fbvins/frontend/track_table.hpp"

namespace fbvins {
namespace observe_test {

const Camera kCamera(PinholeRadtan{230, 229, 160, 118, -0.28, 0.07, 2e-4, 2e-5}, 320, 240);

TEST(Observe, WeighsAResidualInSigmasOfTheRawImage) {
  const Vec2 normalised(0.3, -0.2), px = kCamera.distort(normalised);
  const Observation seen = observe(kCamera, px, normalised, 0.5);
  const Vec2 step(1e-6, -2e-6);
  const Vec2 moved_px = kCamera.distort(normalised + step) - px;
  EXPECT_LT((seen.sqrt_information * step - moved_px / 0.5).norm(), 1e-4 * moved_px.norm());
  EXPECT_EQ(seen.pixel, px);
}

TEST(FeaturesOf, AreThoseOfTheTracksInSight) {
  std::vector<TrackState> tracks(3);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    tracks[i].id = TrackId{static_cast<std::int64_t>(i)};
    tracks[i].px = kCamera.distort(tracks[i].normalised);
  }
  tracks[1].observed = false;
  tracks[2].age_frames = 7;
  tracks[2].right = observe(kCamera, Vec2(100, 50), Vec2(-0.2, -0.3), 1);
  const std::vector<TrackedFeature> features = features_of(tracks, kCamera, 1);
  ASSERT_EQ(features.size(), 2u);
  EXPECT_EQ(features[0].id, TrackId{0});
  EXPECT_FALSE(features[0].right());
  EXPECT_EQ(features[1].id, TrackId{2});
  EXPECT_EQ(features[1].age_frames, 7);
  EXPECT_EQ(features[1].right()->pixel, Vec2(100, 50));
}

}  // namespace observe_test
}  // namespace fbvins
