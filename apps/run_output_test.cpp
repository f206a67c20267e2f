// SPDX-License-Identifier: Apache-2.0
#include "apps/run_output.hpp"

#include <gtest/gtest.h>

#include "fbvins/io/trajectory.hpp"
#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace run_output_test {

constexpr HealthState kGood = HealthState::good, kStarting = HealthState::initialising;

Odometry odometry(std::int64_t k, HealthState state = kGood) {
  Odometry o;
  o.id = FrameId{k};
  o.t = Time{1'000'000'000 + k * 50'000'000};
  o.T_WB.p = Vec3(0.1 * static_cast<double>(k), 0, 0);
  o.health.state = state;
  o.stats.landmarks = 100;
  return o;
}

TrackedRecord tracked(std::int64_t k) {
  TrackedRecord r{FrameId{k}, Time{1'000'000'000 + k * 50'000'000}, {}, {}};
  r.stats.tracked = 40 + static_cast<int>(k);
  return r;
}

TEST(RunRecord, PosesAreThoseOfFramesThatHaveOne) {
  RunRecord record;
  record.odometry = {odometry(0, kStarting), odometry(1), odometry(2)};
  EXPECT_EQ(record.images().size(), 3u);
  ASSERT_EQ(record.poses().size(), 2u);
  EXPECT_EQ(record.poses()[0].t, odometry(1).t);
}

TEST(RunWriter, ARowForEveryImageAndAPoseWhereThereIsOne) {
  const test::Folder folder("run_writer");
  RunRecord record;
  for (int k = 0; k < 4; ++k) {
    record.tracked.push_back(tracked(k));
    record.odometry.push_back(odometry(k, k == 0 ? kStarting : kGood));
  }
  ASSERT_TRUE(write_run(record, folder.path()));
  EXPECT_EQ(folder.rows("trajectory_tum.txt").size(), 3u);
  EXPECT_EQ(folder.rows("gauge.csv").size(), 3u);
  for (const char* name : {"trajectory.csv", "covariance.csv", "statistics.csv", "timing.csv"})
    EXPECT_EQ(folder.rows(name).size(), 4u) << name;
  EXPECT_EQ(folder.rows("trajectory.csv")[0].find("1000000000,nan,nan,nan,nan,"), 0u);
  EXPECT_EQ(folder.rows("covariance.csv")[0].find("1000000000,nan,nan,nan,nan,"), 0u);
  for (const char* name : {"trajectory.csv", "covariance.csv"}) {
    EXPECT_EQ(test::columns(folder.rows(name)[0]), test::columns(folder.rows(name)[1])) << name;
    EXPECT_EQ(folder.rows(name)[1].find("nan"), std::string::npos) << name;
  }
  const auto read = read_trajectory(folder.path() + "/trajectory.csv");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->without_pose, 1);
  EXPECT_EQ(read->counts.bad(), 0);
  EXPECT_EQ(read->points.size(), 3u);
  EXPECT_EQ(folder.rows("trajectory_tum.txt")[0].substr(0, 24), "1.050000000 0.100000000 ");
}

TEST(RunWriter, EveryRowHasTheHeadersColumns) {
  const test::Folder folder("run_columns");
  RunRecord record;
  record.tracked = {tracked(0)};
  record.odometry = {odometry(0)};
  ASSERT_TRUE(write_run(record, folder.path()));
  for (const char* name : {"trajectory.csv", "covariance.csv", "gauge.csv", "statistics.csv", "timing.csv"}) {
    const std::string text = folder.text(name);
    EXPECT_EQ(test::columns(text.substr(0, text.find('\n'))), test::columns(folder.rows(name).at(0))) << name;
  }
}

TEST(RunWriter, AFrameThatTheEstimatorSkippedHasZerosOfIts) {
  const test::Folder folder("run_skipped");
  auto writer = RunWriter::create(folder.path());
  ASSERT_TRUE(writer) << writer.error().message;
  for (int k = 0; k < 3; ++k) writer->add(tracked(k));
  writer->add(odometry(1));
  EXPECT_TRUE(folder.text("statistics.csv").empty()) << "whole or not at all";
  ASSERT_TRUE(writer->close());
  const auto rows = folder.rows("statistics.csv");
  ASSERT_EQ(rows.size(), 3u) << "also those whose odometry never came";
  EXPECT_NE(rows[1].find(",100,"), std::string::npos);
  EXPECT_EQ(rows[0].find(",100,"), std::string::npos);
  EXPECT_EQ(rows[2].find(",100,"), std::string::npos);
}

TEST(RunWriter, SaysWhereItCannotWrite) {
  EXPECT_NE(RunWriter::create("/nowhere").error().message.find("/nowhere/trajectory_tum.txt"), std::string::npos);
}

TEST(Truth, IsWhatLiesAroundTheImages) {
  const test::Folder folder("truth");
  std::vector<TrajectoryPoint> truth;
  for (int i = 0; i < 100; ++i) truth.push_back({Time{i * 10'000'000}, {}, std::nullopt, std::nullopt});
  ASSERT_TRUE(write_truth({Time{205'000'000}, Time{300'000'000}, Time{5'000'000'000}}, truth, folder.path()));
  const auto rows = folder.rows("ground_truth.csv");
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows[0].substr(0, 10), "200000000,");
  EXPECT_EQ(rows[1].substr(0, 10), "210000000,");
  EXPECT_EQ(rows.back().substr(0, 10), "990000000,") << "the last one before an image beyond the truth";
  EXPECT_LE(rows.size(), 6u);
  EXPECT_EQ(test::columns(rows[0]), 8);
}

}  // namespace run_output_test
}  // namespace fbvins::app
