// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/motion_capture.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>

#include "fbvins/core/rng.hpp"
#include "fbvins/io/cdr.hpp"
#include "fbvins/io/mcap_writer.hpp"
#include "fbvins/io/ros_messages.hpp"
#include "tests/support/marker_test_files.hpp"

namespace fbvins {
namespace motion_capture_test {

using test::motive_csv;
using test::qualisys_tsv;
using test::vicon_csv;
using test::WrittenFile;

/// Two bodies that tumble; the second is not seen in rows 10 to 14.
WrittenFile two_bodies() {
  Rng rng(5);
  WrittenFile file;
  file.bodies = {{"quad", {}}, {"the wand", {}}};
  const auto random = [&] { return Vec3{rng.normal(), rng.normal(), rng.normal()}; };
  for (int i = 0; i < 40; ++i) {
    for (test::WrittenBody& body : file.bodies) {
      const Vec3 theta = random(), p = random();
      body.poses.emplace_back(Pose<V, K>(so3_exp(theta), p));
    }
    if (i >= 10 && i < 15) file.bodies[1].poses.back().reset();
  }
  return file;
}

void expect_poses(const MarkerBody& body, const test::WrittenBody& written, double rate_hz, int first_frame) {
  int seen = 0, unseen = 0;
  for (std::size_t i = 0; i < written.poses.size(); ++i) {
    if (!written.poses[i]) {
      ++unseen;
      continue;
    }
    ASSERT_LT(static_cast<std::size_t>(seen), body.track.size());
    const MarkerPose& pose = body.track[static_cast<std::size_t>(seen++)];
    EXPECT_NEAR(pose.t.seconds(), (static_cast<double>(i) + first_frame) / rate_hz, 6e-6);
    EXPECT_LT((pose.T_VK.p - written.poses[i]->p).norm(), 2e-8);
    EXPECT_LT(so3_log(pose.T_VK.q.conjugate() * written.poses[i]->q).norm(), 2e-8);
  }
  EXPECT_EQ(body.track.size(), static_cast<std::size_t>(seen));
  EXPECT_EQ(body.unseen, unseen);
}

struct Format {
  std::string name, format, text, name_prefix;
  int first_frame = 0;
};

std::vector<Format> formats() {
  const WrittenFile file = two_bodies();
  return {{"motive", "Motive CSV", motive_csv(file), ""},
          {"motive in mm", "Motive CSV", motive_csv(file, true), ""},
          {"vicon objects", "Vicon CSV", vicon_csv(file, true), "quad:", 1},
          {"vicon segments", "Vicon CSV", vicon_csv(file, false, "Segments"), "quad:", 1},
          {"qualisys", "Qualisys TSV", qualisys_tsv(file), ""},
          {"qualisys by frames", "Qualisys TSV", qualisys_tsv(file, false), "", 1}};
}

TEST(MotionCapture, TablesOfThreeVendorsGiveTheSamePoses) {
  const WrittenFile file = two_bodies();
  for (const Format& format : formats()) {
    SCOPED_TRACE(format.name);
    const auto read = parse_motion_capture(format.text, "take");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->format, format.format);
    EXPECT_EQ(read->counts.bad(), 0) << read->counts.first_bad;
    ASSERT_EQ(read->bodies.size(), 2u);
    EXPECT_EQ(read->bodies[0].name, format.name_prefix + "quad");
    for (std::size_t i = 0; i < 2; ++i) expect_poses(read->bodies[i], file.bodies[i], file.rate_hz, format.first_frame);
  }
}

TEST(MotionCapture, MotivesUpBecomesZ) {
  const std::string text = motive_csv({.bodies = {{"a", {Pose<V, K>(Quat::Identity(), Vec3(1, 2, 3))}}}});
  EXPECT_NE(text.find(",1.000000000,3.000000000,-2.000000000,"), std::string::npos) << "y up in the file";
  const auto read = parse_motion_capture(text, "take");
  ASSERT_TRUE(read.ok());
  EXPECT_LT((read->bodies[0].track[0].T_VK.p - Vec3(1, 2, 3)).norm(), 1e-12);
}

TEST(MotionCapture, AThirdPartyTsvIsRead) {
  // Rows of a published recording (a model ship), a check on the order of the rotation's nine elements: roll -0.656 degrees.
  const std::string text =
      "NO_OF_FRAMES\t1\nNO_OF_CAMERAS\t4\nNO_OF_BODIES\t1\nFREQUENCY\t100\nDATA_INCLUDED\t6D\nBODY_NAMES\tPSVH\n"
      "Frame\tTime\tPSVH X\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]\tRot[4]\tRot[5]\tRot[6]\tRot[7]\tRot[8]\n"
      "1\t0.00000\t-194.91974\t2.24150\t0.99661\t-0.65630\t0.09391\t0.05772\t4.98536\t1.00000\t0.00099\t-0.00165\t-0.00101\t0.99993\t"
      "-0.01145\t0.00164\t0.01145\t0.99993\n";
  const auto read = parse_motion_capture(text, "ship.tsv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const Vec3 turned = so3_log(read->bodies[0].track[0].T_VK.q) * (180 / std::numbers::pi);
  EXPECT_NEAR(turned.x(), -0.6563, 2e-3);
  EXPECT_NEAR(turned.y(), 0.0939, 2e-3);
  EXPECT_NEAR(turned.z(), 0.0577, 2e-3);
}

TEST(MotionCapture, PlainTrajectoriesAreRead) {
  const auto tum = parse_motion_capture("1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0 1\n", "a.txt");
  ASSERT_TRUE(tum.ok());
  EXPECT_EQ(tum->format, "TUM");
  EXPECT_EQ(tum->bodies[0].track[1].t, Time{1'600'000'000});
  const auto euroc = parse_motion_capture("#timestamp [ns],p,p,p,q,q,q,q\n1403636580838555648,1,2,3,1,0,0,0\n", "data.csv");
  ASSERT_TRUE(euroc.ok());
  EXPECT_EQ(euroc->format, "EuRoC CSV");
  EXPECT_EQ(euroc->bodies[0].track[0].T_VK.p, Vec3(1, 2, 3));
}

TEST(MotionCapture, BodiesAreChosenByName) {
  const auto choose = [](std::string_view name) {
    return choose_body(*parse_motion_capture(motive_csv(two_bodies()), "take.csv"), name, "take.csv");
  };
  ASSERT_TRUE(choose("the wand").ok());
  EXPECT_EQ(choose("the wand")->unseen, 5);
  EXPECT_EQ(choose("").error().message, "take.csv: there are 2 bodies in it, choose one by name: 'quad', 'the wand'");
  EXPECT_EQ(choose("drone").error().message, "take.csv: there is no body 'drone' in it, only 'quad', 'the wand'");
}

TEST(MotionCapture, WhatCannotBeUsedIsSaidInASentence) {
  const WrittenFile file = two_bodies();
  const auto sentence = [](const std::string& text) {
    const auto read = parse_motion_capture(text, "take.csv");
    return read.ok() ? "read" : read.error().message;
  };
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
    return text;
  };
  const std::string motive = motive_csv(file);
  EXPECT_EQ(sentence(replaced(motive, "Rotation Type,Quaternion", "Rotation Type,XYZ")),
            "take.csv:1: rotations of type 'XYZ': export quaternions");
  EXPECT_EQ(sentence(replaced(motive, "Units,Meters", "Units,Feet")),
            "take.csv:1: lengths in 'Feet': export metres or millimetres");
  EXPECT_EQ(sentence(replaced(motive, "Rigid Body", "Marker")), "take.csv:3: there is no rigid body in it: export rigid bodies");
  EXPECT_EQ(sentence(replaced(vicon_csv(file, true), "Objects", "Trajectories")),
            "take.csv:1: Vicon's table of Trajectories has no poses: export objects or segments");
  EXPECT_NE(sentence(replaced(vicon_csv(file, false), "deg", "rad")).find("these are not helical angles"), std::string::npos);
  EXPECT_EQ(sentence(replaced(qualisys_tsv(file), "\t6D", "\t3D")), "take.csv:9: 3D data: export 6D");
  EXPECT_EQ(sentence(replaced(qualisys_tsv(file), "BODY_NAMES", "NAMES")),
            "take.csv:1: there is no body in it (BODY_NAMES): export 6D");
  EXPECT_EQ(
      sentence(replaced(motive, "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,X,Y,Z,W,X,Y,Z,,X,Y,Z", "Frame,Time (Seconds),X,Y,Z")),
      "take.csv: the header names 5 columns where its bodies need 20");
  EXPECT_NE(sentence("a picture, perhaps").find("take.csv"), std::string::npos);
}

TEST(MotionCapture, DamagedRowsAreCounted) {
  std::string text = motive_csv({.bodies = {{"a", std::vector<std::optional<Pose<V, K>>>(20, Pose<V, K>())}}});
  EXPECT_EQ(parse_motion_capture(text, "take")->bodies[0].unseen, 20) << "a body exactly at the origin is one not seen";
  text =
      qualisys_tsv({.bodies = {{"a", std::vector<std::optional<Pose<V, K>>>(20, Pose<V, K>(Quat::Identity(), Vec3(1, 1, 1)))}}});
  text.replace(text.rfind("1.000000000"), 11, "0.500000000");
  const auto read = parse_motion_capture(text, "take");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->counts.malformed, 1);
  EXPECT_EQ(read->counts.first_bad, "take:31: the nine elements are not those of a rotation");
  EXPECT_EQ(read->bodies[0].track.size(), 19u);
}

// -------------------------------------------------------------------------------------------------- MCAP

void append_pose_stamped(std::string& out, Time t, const Pose<V, K>& pose) {
  CdrWriter cdr(out);
  cdr.put(static_cast<std::int32_t>(t.ns / 1'000'000'000));
  cdr.put(static_cast<std::uint32_t>(t.ns % 1'000'000'000));
  cdr.text("mocap");
  for (const double v : {pose.p.x(), pose.p.y(), pose.p.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w()}) cdr.put(v);
}

std::string record_of_poses(const WrittenFile& file) {
  const std::string path = testing::TempDir() + "/fbvins_poses.mcap";
  std::filesystem::remove(path);
  auto writer = McapWriter::create(path, {},
                                   {{"/quad/pose", "geometry_msgs/msg/PoseStamped", ""},
                                    {"/quad/odom", "nav_msgs/msg/Odometry", ""},
                                    {"/imu", "sensor_msgs/msg/Imu", ""}});
  EXPECT_TRUE(writer.ok());
  for (std::size_t i = 0; i < file.bodies[0].poses.size(); ++i) {
    const Time t{static_cast<std::int64_t>(i) * 8'333'333 + 5'000'000'001};
    append_pose_stamped(writer->begin_message(0, t), t, *file.bodies[0].poses[i]);
    writer->end_message();
    RosOdometry odometry;
    odometry.t = t;
    odometry.T_WB = file.bodies[0].poses[i]->cast_frames<W, B>();
    append_odometry(writer->begin_message(1, t), odometry);
    writer->end_message();
    append_imu(writer->begin_message(2, t), ImuSample{t}, {});
    writer->end_message();
  }
  EXPECT_TRUE(writer->finish().ok());
  return path;
}

TEST(MotionCapture, TopicsOfAnMcapAreBodies) {
  const WrittenFile file = two_bodies();
  const auto read = read_motion_capture(record_of_poses(file));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->format, "MCAP");
  ASSERT_EQ(read->bodies.size(), 2u);
  EXPECT_EQ(read->bodies[1].name, "/quad/pose");
  for (const MarkerBody& body : read->bodies) {
    ASSERT_EQ(body.track.size(), file.bodies[0].poses.size());
    EXPECT_EQ(body.track[0].t, Time{5'000'000'001});
    for (std::size_t i = 0; i < body.track.size(); ++i) {
      EXPECT_LT((body.track[i].T_VK.p - file.bodies[0].poses[i]->p).norm(), 1e-12);
      EXPECT_LT(so3_log(body.track[i].T_VK.q.conjugate() * file.bodies[0].poses[i]->q).norm(), 1e-12);
    }
  }
}

}  // namespace motion_capture_test
}  // namespace fbvins
