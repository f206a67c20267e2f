// SPDX-License-Identifier: Apache-2.0
#include "apps/live_files.hpp"

#include <gtest/gtest.h>

#include "apps/live_summary.hpp"
#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace live_files_test {

Odometry odometry(int k, std::uint32_t reset_counter, HealthState state = HealthState::good) {
  Odometry o;
  o.id = FrameId{k};
  o.t = Time{1'000'000'000 + k * 50'000'000LL};
  o.reset_counter = reset_counter;
  o.T_WB.p = o.gauge.T_GB.p = Vec3(1, 2, 3);
  o.health.state = state;
  return o;
}

LivePose live_pose(int k, HealthState state = HealthState::good) {
  LivePose pose;
  pose.t = Time{1'000'000'000 + k * 5'000'000LL};
  pose.health.state = state;
  return pose;
}

MapUpdate update(bool localised, std::uint32_t reset_counter) {
  MapUpdate u;
  u.localised = localised;
  u.reset_counter = reset_counter;
  u.T_MG.p = u.T_MW_smooth.p = Vec3(10, 0, 0);
  return u;
}

std::unique_ptr<LiveFiles> files_in(const test::Folder& folder, bool with_map, bool new_map) {
  auto files = LiveFiles::create(folder.path(), with_map, new_map);
  EXPECT_TRUE(files) << (files ? "" : files.error().message);
  return *std::move(files);
}

TEST(LiveFiles, PosesAtImuRateAreThoseThatThereAre) {
  const test::Folder folder("live_files");
  const auto files = files_in(folder, false, true);
  ASSERT_TRUE(files->take(live_pose(0, HealthState::initialising)));
  ASSERT_TRUE(files->take(live_pose(1)));
  ASSERT_TRUE(files->take(odometry(0, 0)));
  ASSERT_TRUE(files->take(ImuSample{}));
  ASSERT_TRUE(files->finish());
  EXPECT_EQ(folder.rows("live_tum.txt").size(), 1u);
  EXPECT_EQ(folder.rows("trajectory.csv").size(), 1u);
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/map_causal_tum.txt"));
}

/// Whatever the process's first reset counter is.
TEST(LiveFiles, ANewMapBeginsWhereTheFirstFrameWDoes) {
  for (const std::uint32_t first : {0u, 7u}) {
    const test::Folder folder("live_new_map");
    const auto files = files_in(folder, true, true);
    ASSERT_TRUE(files->take(odometry(0, first)));
    ASSERT_TRUE(files->take(odometry(1, first + 1)));  // a restart before the first update: where it is in M is not known
    ASSERT_TRUE(files->finish());
    ASSERT_EQ(folder.rows("map_causal_tum.txt").size(), 1u) << first;
    EXPECT_EQ(folder.rows("map_causal_tum.txt")[0].substr(0, 35), "1.000000000 1.000000000 2.000000000");
    EXPECT_EQ(folder.rows("map_bounded_tum.txt").size(), 1u);
  }
}

TEST(LiveFiles, InAnOldMapPosesComeOnceItIsLocalised) {
  const test::Folder folder("live_old_map");
  const auto files = files_in(folder, true, false);
  ASSERT_TRUE(files->take(odometry(0, 0)));
  ASSERT_TRUE(files->take(update(false, 0)));
  ASSERT_TRUE(files->take(odometry(1, 0)));
  ASSERT_TRUE(files->take(update(true, 0)));
  ASSERT_TRUE(files->take(odometry(2, 0)));
  ASSERT_TRUE(files->take(odometry(3, 1)));  // another W
  ASSERT_TRUE(files->take(odometry(4, 0, HealthState::initialising)));
  ASSERT_TRUE(files->finish());
  const auto rows = folder.rows("map_causal_tum.txt");
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].substr(0, 24), "1.100000000 11.000000000");
}

TEST(LiveTotals, CountsByHealthAndKeepsTheNewestGoodBiases) {
  LiveTotals totals;
  const auto sink = totals.make_sink(0);
  Odometry good = odometry(0, 0), later = odometry(1, 0), lost = odometry(2, 0, HealthState::lost);
  good.accel_bias_covariance = later.accel_bias_covariance = lost.accel_bias_covariance = Mat3::Identity();
  lost.health.reason = HealthReason::no_images;
  for (const Odometry& o : {good, later, lost}) ASSERT_TRUE(sink->take(o));
  ASSERT_TRUE(sink->take(live_pose(0)));
  ASSERT_TRUE(sink->take(live_pose(1, HealthState::initialising)));
  EXPECT_EQ(totals.health.at("good"), 2);
  EXPECT_EQ(totals.health.at("lost/no_images"), 1);
  EXPECT_EQ(totals.with_pose, 2 + (lost.health.has_pose() ? 1 : 0));
  EXPECT_EQ(totals.live_poses, 1);
  ASSERT_TRUE(totals.imu_state);
  EXPECT_EQ(totals.imu_state->t, later.t);
}

TEST(LiveSummary, SaysCountsAndWhatSlowOutputsLost) {
  LiveSummary summary;
  summary.source = "socket:x";
  summary.frontend = "orb";
  summary.totals.health["good"] = 9;
  summary.totals.last.counts.images = 10;
  summary.totals.last.counts.images_dropped = 1;
  const std::string quiet = to_text(summary);
  EXPECT_NE(quiet.find("socket:x with orb"), std::string::npos) << quiet;
  EXPECT_NE(quiet.find("images 10, with a pose 0, dropped 1"), std::string::npos) << quiet;
  EXPECT_EQ(quiet.find("slow output"), std::string::npos);
  summary.totals.last.counts.events_lost = 3;
  EXPECT_NE(to_text(summary).find("events that a slow output did not get: 3"), std::string::npos);
  const std::string json = to_json_text(summary);
  for (const char* part : {"\"source\": \"socket:x\"", "\"good\": 9", "\"images_dropped\": 1", "\"events_lost\": 3"})
    EXPECT_NE(json.find(part), std::string::npos) << part << " in " << json;
  EXPECT_EQ(json.find("accuracy"), std::string::npos) << "there is no truth";
}

}  // namespace live_files_test
}  // namespace fbvins::app
