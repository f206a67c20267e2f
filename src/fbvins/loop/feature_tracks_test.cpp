// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/feature_tracks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "tests/support/test_room.hpp"

namespace fbvins {
namespace feature_tracks_test {

using namespace test_room;

/// The true poses of a flight, without loops.
PlaceMap true_map(int keyframes) {
  PlaceMap map;
  map.cameras[0] = rig().T_BC0();
  for (Frame& f : flight(room(1), keyframes, 0, 0, 5)) {
    MapKeyframe k;
    k.t = f.t, k.T_GB = f.truth, k.T_MB = Pose<M, B>(f.truth.q, f.truth.p), k.place = std::move(f.place);
    map.add(std::move(k));
  }
  return map;
}

TEST(FeatureTracks, HoldOneFeatureAKeyframeInOrder) {
  const PlaceMap map = true_map(20);
  const auto tracks = feature_tracks(map, {}, 3, 8.0);
  ASSERT_GT(tracks.size(), 300u);
  std::size_t longest = 0;
  for (const FeatureTrack& t : tracks) {
    ASSERT_GE(t.size(), 2u);
    for (std::size_t i = 1; i < t.size(); ++i) ASSERT_LT(t[i - 1].keyframe, t[i].keyframe);
    longest = std::max(longest, t.size());
  }
  EXPECT_GT(longest, 6u) << "matches of neighbours are chained";
}

TEST(FeatureTracks, ViewsOfATrackShowOnePoint) {
  const PlaceMap map = true_map(10);
  int wrong = 0, views = 0;
  for (const FeatureTrack& t : feature_tracks(map, {}, 3, 8.0)) {
    std::optional<Vec3> p_M;
    for (const FeatureView& v : t) {
      const MapKeyframe& k = map.keyframes()[v.keyframe];
      const PlaceFeature& f = k.place.features[v.feature];
      const Pose<M, C0> T_MC = map.T_MC(k);
      if (!p_M && f.has_point()) p_M = T_MC * f.p_C0();
      if (!p_M) continue;
      wrong += ((T_MC.inverse() * *p_M).hnormalized() - f.xy()).norm() * kFocal > 15, ++views;
    }
  }
  EXPECT_GT(views, 1000);
  EXPECT_LT(wrong, views / 50);
}

TEST(FeatureTracks, ALoopJoinsWhatTimeKeepsApart) {
  PlaceMap map = true_map(90);  // one round takes 18 s
  const auto across = [&] {
    int n = 0;
    for (const FeatureTrack& t : feature_tracks(map, {}, 1, 8.0)) n += t.back().keyframe - t.front().keyframe > 60;
    return n;
  };
  EXPECT_EQ(across(), 0);
  const Pose<B, B> T = map.keyframes()[0].T_MB.inverse() * map.keyframes()[89].T_MB;
  map.edges.push_back({KeyframeId{0}, KeyframeId{89}, T, Mat6::Identity(), MapEdge::Kind::loop});
  EXPECT_GT(across(), 20);
}

TEST(FeatureTracks, KeyframesWithoutAPlaceInMAreLeftOut) {
  PlaceMap map = true_map(6);
  map.keyframes()[3].placed = false;
  for (const FeatureTrack& t : feature_tracks(map, {}, 3, 8.0))
    for (const FeatureView& v : t) EXPECT_NE(v.keyframe, 3u);
}

}  // namespace feature_tracks_test
}  // namespace fbvins
