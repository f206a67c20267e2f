// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/trajectory.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fbvins/io/no_pose.hpp"

namespace fbvins {
namespace trajectory_test {

class TrajectoryFiles : public testing::Test {
 protected:
  TrajectoryFiles() {
    std::string name = (std::filesystem::temp_directory_path() / "fbvins_io_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~TrajectoryFiles() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  static std::string content(const std::string& file) {
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }
  std::string folder_;
};

Odometry some_odometry(int i) {
  Odometry o;
  o.t = Time{1403636584763555584 + i * 50'000'001LL};
  o.T_WB = Pose<W, B>(so3_exp({0.1 * i, 0.2, -0.3}), {1.0 * i, -2.5, 1e-5});
  o.v_WB = Vec3(0.1, -0.2, 0.3 * i);
  o.bias = {{0.001, -0.002, 0.003}, {0.01, -0.02, 0.03}};
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) o.pose_covariance(r, c) = 1e-6 * (1 + std::min(r, c)) * (10 + std::max(r, c));
  o.health = {HealthState::good, HealthReason::none};
  return o;
}

TEST_F(TrajectoryFiles, TumComesBackToTheNanosecond) {
  auto writer = TumWriter::create(path("t.txt"));
  ASSERT_TRUE(writer);
  for (int i = 0; i < 10; ++i) writer->write(some_odometry(i).t, some_odometry(i).T_WB);
  EXPECT_FALSE(std::filesystem::exists(path("t.txt"))) << "it appears when closed";
  ASSERT_TRUE(writer->close());
  EXPECT_FALSE(writer->close()) << "once";
  const auto read = read_trajectory(path("t.txt"));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->points.size(), 10u);
  EXPECT_EQ(read->counts.bad(), 0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(read->points[i].t, some_odometry(i).t);
    EXPECT_LT((read->points[i].T_WB.p - some_odometry(i).T_WB.p).norm(), 1e-9);
    EXPECT_LT(so3_log(read->points[i].T_WB.q.conjugate() * some_odometry(i).T_WB.q).norm(), 1e-8);
    EXPECT_FALSE(read->points[i].v_WB);
  }
  EXPECT_EQ(read->poses().size(), 10u);
}

TEST_F(TrajectoryFiles, OdometryCsvHoldsEverything) {
  auto writer = OdometryCsvWriter::create(path("o.csv"));
  ASSERT_TRUE(writer);
  for (int i = 0; i < 10; ++i) {
    Odometry o = some_odometry(i);
    if (i < 2) o.health = {HealthState::initialising, HealthReason::waiting_for_motion_or_rest};
    if (i == 7) o.health = {HealthState::lost, HealthReason::imu_gap}, o.reset_counter = 1;
    if (i == 8) o.health = {HealthState::degraded, HealthReason::few_tracks};
    writer->write(o);
  }
  ASSERT_TRUE(writer->close());
  const auto read = read_trajectory(path("o.csv"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->without_pose, 3);
  ASSERT_EQ(read->points.size(), 7u);
  const TrajectoryPoint& p = read->points[0];
  EXPECT_EQ(p.t, some_odometry(2).t);
  EXPECT_LT((*p.v_WB - Vec3(0.1, -0.2, 0.6)).norm(), 1e-9);
  EXPECT_LT((p.bias->accel_mps2 - Vec3(0.01, -0.02, 0.03)).norm(), 1e-9);
  const std::string text = content(path("o.csv"));
  EXPECT_EQ(std::count(text.begin(), text.begin() + text.find('\n'), ','), 40);
  EXPECT_NE(text.find(",cov_px_px,cov_px_py,"), std::string::npos);
  EXPECT_NE(text.find(",lost,imu_gap,1\n"), std::string::npos);
  EXPECT_NE(text.find(",1.000000000e-05,1.100000000e-05,"), std::string::npos);
}

TEST_F(TrajectoryFiles, WritingTwiceGivesTheSameBytes) {
  for (const char* name : {"a.csv", "b.csv"}) {
    auto writer = OdometryCsvWriter::create(path(name));
    for (int i = 0; i < 10; ++i) writer->write(some_odometry(i));
    ASSERT_TRUE(writer->close());
  }
  EXPECT_EQ(content(path("a.csv")), content(path("b.csv")));
}

TEST_F(TrajectoryFiles, WhatCannotBeWrittenIsSaid) {
  EXPECT_EQ(TumWriter::create("/nowhere/t.txt").error().message, "/nowhere/t.txt: cannot be written (No such file or directory)");
  EXPECT_EQ(TumWriter::create(folder_).error().message, folder_ + ": is a folder");
}

TEST_F(TrajectoryFiles, AnAbandonedWriterLeavesNothing) {
  {
    auto writer = TumWriter::create(path("t.txt"));
    writer->write(Time{1}, {});
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST(Trajectory, TumAsOtherToolsWriteIt) {
  const auto read = parse_trajectory(
      "# timestamp tx ty tz qx qy qz qw\n1.403636584763555584e+09 1 2 3 0 0 0 1\n"
      "1403636584.8\t1.5  2 3 0.1 0 0 -0.99498743710662 \n",
      "t.txt");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->points[0].t.ns, 1403636584763555584);
  EXPECT_EQ(read->points[1].t.ns, 1403636584800000000);
  EXPECT_NEAR(read->points[1].T_WB.q.x(), 0.1, 1e-12);
  EXPECT_NEAR(read->points[1].T_WB.q.w(), -0.994987, 1e-6);
}

TEST(Trajectory, EurocQuaternionsBeginWithW) {
  const auto read = parse_trajectory("#t,p,q\n100,1,2,3,0.8,0.6,0,0\n", "gt.csv");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_DOUBLE_EQ(read->points[0].T_WB.q.w(), 0.8);
  EXPECT_DOUBLE_EQ(read->points[0].T_WB.q.x(), 0.6);
  EXPECT_FALSE(read->points[0].bias);
}

TEST(Trajectory, BadRowsAreCounted) {
  const auto read = parse_trajectory(
      "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 0\n3 0 0 nan 0 0 0 1\n4 0 0\n5 0 0 0 0 0 0 1\n5 0 0 0 0 0 0 1\n"
      "4.5 0 0 0 0 0 0 1\n6 0 0 0 0 0 0 1\n7 0 0 0 0 0 0 1\n8 0 0 0 0 0 0 1\n",
      "t.txt");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->points.size(), 5u);
  EXPECT_EQ(read->counts.malformed, 2);
  EXPECT_EQ(read->counts.not_finite, 1);
  EXPECT_EQ(read->counts.duplicates, 1);
  EXPECT_EQ(read->counts.backwards, 1);
  EXPECT_EQ(read->counts.first_bad, "t.txt:2: the quaternion's length is 0");
}

TEST(Trajectory, ErrorsNameTheLine) {
  const auto message = [](const char* text) { return parse_trajectory(text, "t").error().message; };
  EXPECT_EQ(message(""), "t: there are no data rows in it");
  EXPECT_EQ(message("# only\n"), "t: there are no data rows in it");
  EXPECT_EQ(message("\n1 2 3\n"), "t:2: 3 columns where 8 are needed (1 of 1 rows are unusable)");
  EXPECT_EQ(message("1x,0,0,0,1,0,0,0\n"), "t:1: '1x' is not a stamp in nanoseconds (1 of 1 rows are unusable)");
  EXPECT_EQ(message("1,0,0,0,1,0,0,0,5\n"), "t:1: 9 columns where 8, 11 or at least 17 are needed");
  EXPECT_NE(message(";;;;;;;;\n1;2;3;4;5;6;7;8;9\n"), "");  // a first row of separators alone
  EXPECT_EQ(read_trajectory("/nowhere").error().message, "/nowhere: no such file");
}

/// Of each file's three rows the last: 1403636584.863555584 s at (1, 2, 3), a quarter turn about z.
void expect_last(const std::string& text, const std::string& recognised, const TrajectoryFormat& format = {}) {
  const auto file = parse_trajectory(text, "t", format);
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_EQ(file->points.size(), 3u);
  const TrajectoryPoint& last = file->points.back();
  EXPECT_LT(std::abs(last.t.ns - 1403636584863555584), 1000) << text;
  EXPECT_LT((last.T_WB.p - Vec3(1, 2, 3)).norm(), 1e-12);
  EXPECT_NEAR(last.T_WB.q.z(), 0.5 * std::sqrt(2), 1e-6) << text;
  EXPECT_EQ(file->recognised, recognised);
}

/// Three rows whose stamps are 50 ms apart, of `behind` the stamp, each ended by `end`.
std::string three(const std::vector<std::string>& stamps, const std::string& behind, const std::string& end = "\n") {
  std::string out;
  for (const std::string& stamp : stamps) out += stamp + behind + end;
  return out;
}

const std::vector<std::string> kNs = {"1403636584763555584", "1403636584813555456", "1403636584863555584"};
const std::vector<std::string> kSeconds = {"1403636584.763555584", "1403636584.813555456", "1403636584.863555584"};
const std::string kWFirst = ",1,2,3,0.70710678,0,0,0.70710678", kWLast = " 1 2 3 0 0 0.70710678 0.70710678";

TEST(Trajectory, AsOtherSystemsWriteIt) {
  expect_last(three(kNs, kWFirst, ",\n"), "");                                               // VINS-Fusion
  expect_last(three(kNs, kWFirst + ",0.1,0.2,0.3", ",\n"), "the velocity behind the pose");  // VINS-Mono
  expect_last(three({"1403636584763555584.000000", "1403636584813555456.000000", "1403636584863555584.000000"}, kWLast),
              "stamps in nanoseconds");  // ORB-SLAM3
  expect_last(three({"1403636584763555", "1403636584813555", "1403636584863555"}, kWLast), "stamps in microseconds");
  expect_last(three({"1403636584763.555584", "1403636584813.555456", "1403636584863.555584"}, kWLast), "stamps in milliseconds");
  expect_last(three({"1.403636584763555584e+18", "1.403636584813555456e+18", "1.403636584863555584e+18"},
                    " 1.0e+00 2.0e+00 3.0e+00 0 0 7.0710678e-01 7.0710678e-01"),
              "stamps in nanoseconds");                                                           // numpy
  expect_last(three(kSeconds, kWLast + " 1e-6 0 1e-6", "  \r\n"), "3 further columns left out");  // OpenVINS
  expect_last("num,t,x,y,z,qx,qy,qz,qw\n" + three({"0,1403636584.763555", "1,1403636584.813555", "2,1403636584.863555584"},
                                                  ",1,2,3,0,0,0.70710678,0.70710678"),
              "a running number before the stamp, stamps in seconds, quaternions x y z w");
}

TEST(Trajectory, OrderOfTheQuaternionIsSaidWhereItIsAssumed) {
  const std::string commas = ",1,2,3,0,0,0.70710678,0.70710678", semicolons = ";1;2;3;0;0;0.70710678;0.70710678";
  expect_last(three(kSeconds, commas), "stamps in seconds, quaternions x y z w (if that is wrong: --format wxyz)");
  expect_last(three(kSeconds, semicolons),
              "columns between semicolons, stamps in seconds, quaternions x y z w (if that is wrong: --format wxyz)");
  expect_last(three(kSeconds, kWFirst), "stamps in seconds", *parse_trajectory_format("s,wxyz"));
  expect_last("t,x,y,z,qw,qx,qy,qz\n" + three(kSeconds, kWFirst), "stamps in seconds");
  for (const char* names : {"q_WS_x, q_WS_y, q_WS_z, q_WS_w", "ox,oy,oz,ow", "rot.x [], rot.y [], rot.z [], rot.w []"})
    expect_last(std::string("t, p_WS_x, p_WS_y, p_WS_z, ") + names + "\n" + three(kSeconds, commas),
                "stamps in seconds, quaternions x y z w");
  EXPECT_EQ(parse_trajectory_format("zyxw").error().message, "'zyxw' is neither ns, us, ms, s, wxyz nor xyzw");
}

TEST(Trajectory, RowsWithNaNAreCountedHoweverMany) {
  std::string text = kSeconds[0] + kWLast + "\n";
  for (int i = 0; i < 5; ++i) text += fmt::format("14036365{}.5 nan nan nan nan nan nan nan\n", 85 + i);
  const auto file = parse_trajectory(text, "t");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->points.size(), 1u);
  EXPECT_EQ(file->counts.not_finite, 5);
}

TEST(Trajectory, KittisPosesHaveNoTimes) {
  const auto file = parse_trajectory("1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 5 0 1 0 6 0 0 1 8\n", "00.txt");
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.error().message.find("00.txt: KITTI's poses, 12 numbers a row without a time"), std::string::npos)
      << file.error().message;
}

TEST(Trajectory, KittisPosesWithTheirTimesBeside) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "fbvins_kitti";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "poses");
  std::filesystem::create_directories(folder / "sequences/07");
  std::ofstream(folder / "poses/07.txt") << "1 0 0 5 0 1 0 6 0 0 1 7\n0 -1 0 5 1 0 0 6 0 0 1 8\n";
  const std::string path = (folder / "poses/07.txt").string();
  EXPECT_NE(read_trajectory(path).error().message.find("put its times.txt beside it"), std::string::npos);
  std::ofstream(folder / "sequences/07/times.txt") << "0.000000e+00\n1.037359e-01\n";
  const auto file = read_trajectory(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_NE(file->recognised.find("07/times.txt"), std::string::npos) << file->recognised;
  ASSERT_EQ(file->points.size(), 2u);
  EXPECT_EQ(file->points[1].t, Time{103'735'900});
  EXPECT_EQ(file->points[1].T_WB.p, Vec3(5, 6, 8));
  EXPECT_NEAR(file->points[1].T_WB.q.w(), std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(file->points[1].T_WB.q.z(), std::sqrt(0.5), 1e-9);
  std::ofstream(folder / "sequences/07/times.txt") << "0\n";
  EXPECT_NE(read_trajectory(path).error().message.find("2 poses, and 1 times"), std::string::npos);
  std::ofstream(folder / "poses/07.txt") << "1 0 0 5 0 2 0 6 0 0 1 7\n";
  EXPECT_NE(read_trajectory(path).error().message.find("07.txt:1: not a rotation"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(Trajectory, OpenVinsStateHasTheQuaternionFirst) {
  std::string text = "# timestamp(s) q p v bg ba cam_imu_dt num_cam cam0_k cam0_d cam0_rot cam0_trans\n";
  for (int i = 0; i < 5; ++i)
    text += fmt::format("1403636624.{}63556 0.6 0 0 0.8 {} 2 3 0.1 0.2 0.3 0 0 0 0 0 0 0.0 2\n", i, 10 + i);
  const auto file = parse_trajectory(text, "state_est.txt");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_NE(file->recognised.find("the quaternion before the position"), std::string::npos) << file->recognised;
  ASSERT_EQ(file->points.size(), 5u);
  EXPECT_EQ(file->points[2].T_WB.p, Vec3(12, 2, 3));
  EXPECT_NEAR(file->points[2].T_WB.q.x(), 0.6, 1e-12);
  EXPECT_NEAR(file->points[2].T_WB.q.w(), 0.8, 1e-12);
}

TEST(Trajectory, AnglesOnlyWhereTheFileSaysSoOrTheyCanBeNothingElse) {
  const auto degrees = parse_trajectory("#t x y z roll pitch yaw\n1.5 1 2 3 0 0 90\n2.5 1 2 3 0 0 -90\n", "a.txt");
  ASSERT_TRUE(degrees.ok()) << degrees.error().message;
  EXPECT_NE(degrees->recognised.find("roll, pitch and yaw in degrees"), std::string::npos) << degrees->recognised;
  EXPECT_NEAR(degrees->points[0].T_WB.q.z(), std::sqrt(0.5), 1e-12);
  const auto radians = parse_trajectory("#t x y z roll pitch yaw\n1.5 1 2 3 0 0 1.5\n", "a.txt");
  ASSERT_TRUE(radians.ok()) << radians.error().message;
  EXPECT_NEAR(radians->points[0].T_WB.q.z(), std::sin(0.75), 1e-12);
  EXPECT_TRUE(parse_trajectory("1.5 1 2 3 0 0 90\n2.5 1 2 3 0 0 -90\n", "a.txt").ok());
  EXPECT_FALSE(parse_trajectory("1.5 1 2 3 0 0 0.5\n2.5 1 2 3 0 0 0.6\n", "a.txt").ok()) << "a column is missing";
  EXPECT_FALSE(
      parse_trajectory("1403636624463555584,0.1,0.2,0.3,8.1,0.2,-3\n1403636624468555584,0.1,0.2,0.3,8.1,0.2,-3\n", "imu.csv")
          .ok());
}

TEST(Trajectory, OfAFlightWithoutAPoseHealthIsSaid) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "fbvins_no_pose";
  std::filesystem::create_directories(folder);
  std::string row = ",nan";
  for (int i = 0; i < 36; ++i) row += ",nan";
  std::string text = "#timestamp\n";
  for (int i = 0; i < 4; ++i)
    text += fmt::format("{}{},initialising,{},0\n", 1403636624463555584 + i * 50000000, row, i < 3 ? "imu_gap" : "few_tracks");
  std::ofstream(folder / "trajectory.csv") << text;
  std::ofstream(folder / "trajectory_tum.txt") << "";
  for (const char* name : {"trajectory.csv", "trajectory_tum.txt"}) {
    const auto file = read_trajectory((folder / name).string());
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.error().message.find("no pose in any of 4 images: health is initialising/imu_gap in 75 % of them"),
              std::string::npos)
        << file.error().message;
  }
  std::filesystem::remove_all(folder);
}

TEST(NoPose, FewGoodPosesAreSaidWithTheirReason) {
  EXPECT_EQ(few_good_sentence({{"good", 50}, {"degraded/contradiction", 50}, {"initialising/imu_gap", 90}}), "");
  EXPECT_EQ(few_good_sentence({{"initialising/imu_gap", 90}}), "");
  EXPECT_EQ(few_good_sentence({{"good", 1}, {"degraded/contradiction", 7}, {"degraded/few_tracks", 2}, {"lost/no_tracks", 40}}),
            "only 1 of 10 poses are good: health is degraded/contradiction in 7 of them (docs/troubleshooting.md)");
  EXPECT_EQ(few_good_sentence({{"good", 119}, {"degraded/contradiction", 95}, {"lost/contradiction", 2}}, 2),
            "the pose was lost and found anew 2 times: health is degraded/contradiction in 95 of 214 images with a pose "
            "(docs/troubleshooting.md)");
}

}  // namespace trajectory_test
}  // namespace fbvins
