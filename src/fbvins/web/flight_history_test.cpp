// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/flight_history.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace flight_history_test {

Odometry pose_at(double x, std::uint32_t reset_counter = 0) {
  Odometry o;
  o.health.state = HealthState::good;
  o.T_WB.p = Vec3(x, 0, 0);
  o.reset_counter = reset_counter;
  return o;
}

TEST(Thinned, KeepsTheWholeTimeInBoundedMemory) {
  Thinned<int> series(8);
  for (int i = 0; i < 1000; ++i) {
    series.push(i);
    ASSERT_LE(series.values().size(), 8u);
  }
  const std::vector<int>& kept = series.values();
  EXPECT_EQ(kept.front(), 0);
  for (std::size_t i = 1; i < kept.size(); ++i) EXPECT_EQ(kept[i] - kept[i - 1], kept[1]);
  EXPECT_GT(kept.back(), 1000 - 2 * kept[1]);
}

TEST(FlightHistory, PathLengthLeavesOutTheJumpAtARestart) {
  FlightHistory history;
  history.add(0, pose_at(0), nullptr);
  history.add(1, pose_at(2), nullptr);
  history.add(2, pose_at(100, 1), nullptr);
  history.add(3, pose_at(101, 1), nullptr);
  EXPECT_DOUBLE_EQ(history.distance_m(), 3);
  EXPECT_EQ(history.path().size(), 4u);
}

TEST(FlightHistory, NotesHealthWhenItChanges) {
  FlightHistory history;
  Odometry blind = pose_at(0);
  blind.health = {HealthState::degraded, HealthReason::no_images};
  for (const auto& [t, o] : {std::pair{0., pose_at(0)}, {1., pose_at(0)}, {2., blind}, {3., blind}, {4., pose_at(0)}})
    history.add(t, o, nullptr);
  ASSERT_EQ(history.health().size(), 3u);
  EXPECT_EQ(history.health()[1].t_s, 2);
  EXPECT_EQ(history.health()[1].health, blind.health);
}

TEST(FlightHistory, HasNoPathWithoutAPose) {
  FlightHistory history;
  history.add(0, Odometry{}, nullptr);
  EXPECT_TRUE(history.path().empty());
  EXPECT_LT(history.newest().sigma_m, 0);
  EXPECT_LT(history.newest().latency_ms, 0);
}

TEST(PointCloud, HoldsTheLastPositionsOfTheNewestTracks) {
  PointCloud cloud;
  const auto most = static_cast<std::int64_t>(PointCloud::kMost);
  for (std::int64_t i = 0; i < most + 10; ++i) cloud.add({TrackId{i}, Vec3(1, 0, 0)});
  cloud.add({TrackId{most + 9}, Vec3(2, 0, 0)});
  ASSERT_EQ(cloud.points().size(), PointCloud::kMost);
  for (const LiveView::Landmark& point : cloud.points()) {
    EXPECT_GE(point.track.value, 10);
    EXPECT_EQ(point.p_W.x(), point.track.value == most + 9 ? 2 : 1);
  }
}

}  // namespace flight_history_test
}  // namespace fbvins
