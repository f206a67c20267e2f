// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/marker_faults.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace marker_faults_test {

MarkerTrack circle(int poses) {
  MarkerTrack track;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.01 * i;
    track.push_back({Time{10'000'000LL * i}, {so3_exp(Vec3(0, 0, t)), Vec3(std::cos(t), std::sin(t), 1)}});
  }
  return track;
}

TEST(MarkerFaults, AGoodTrackHasNone) {
  const MarkerTrack track = circle(500);
  const MarkerInspection found = inspect(track);
  EXPECT_NEAR(found.rate_hz, 100, 1e-9);
  EXPECT_TRUE(found.faults.empty());
  EXPECT_EQ(found.kept(track).size(), 500u);
  EXPECT_TRUE(inspect({}).faults.empty());
}

TEST(MarkerFaults, GapsHeldPosesAndSwapsAreFoundAndLeftOut) {
  MarkerTrack track = circle(1000);
  for (std::size_t i = 700; i < 780; ++i) track[i].T_VK.p += Vec3(0.7, 0, 0);  // another body for 0.8 s
  for (std::size_t i = 401; i < 410; ++i) track[i].T_VK = track[400].T_VK;
  track.erase(track.begin() + 200, track.begin() + 250);
  const MarkerInspection found = inspect(track);
  ASSERT_EQ(found.faults.size(), 3u);
  EXPECT_EQ(to_string(found.faults[0], Time{}), "gap, 1.990 s to 2.500 s");
  EXPECT_EQ(to_string(found.faults[1], Time{}), "held, 4.000 s to 4.090 s");
  EXPECT_EQ(to_string(found.faults[2], Time{}), "jump by 0.694 m and 0.6 degrees, 7.000 s to 7.790 s");
  EXPECT_NEAR(found.unseen_share, 0.51 / 9.99, 1e-9);
  EXPECT_EQ(found.kept(track).size(), 1000u - 50 - 9 - 80);
}

TEST(MarkerFaults, TheBodyThatIsSeenMostStays) {
  MarkerTrack track = circle(1000);
  for (std::size_t i = 0; i < 400; ++i) track[i].T_VK.q = track[i].T_VK.q * so3_exp(Vec3(3.1, 0, 0));
  const MarkerTrack kept = inspect(track).kept(track);
  EXPECT_EQ(kept.size(), 600u);
  EXPECT_EQ(kept.front().t, track[400].t);
}

}  // namespace marker_faults_test
}  // namespace fbvins
