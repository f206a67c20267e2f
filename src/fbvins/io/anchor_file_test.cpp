// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/anchor_file.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace anchor_file_test {

TEST(AnchorFile, PositionsHeightsAndLeverArms) {
  const auto read = parse_anchors(
      "#timestamp [ns],x,y,z,sx,sy,sz\r\n"
      "2000,1,2,3,0.1,0.2,0.3\n"
      "1000,nan,nan,1.5,,,0.02\n"
      "3000,,,1.25,0,0,0.05,0.1,0,-0.2\n"
      "2000,4,5,6,1,1,1,0.5,0,0\n",
      "p.csv");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 4u);
  const auto& height = std::get<HeightAnchor>((*read)[0]);
  EXPECT_EQ(height.t, Time{1000});
  EXPECT_EQ(height.z_A_m, 1.5);
  EXPECT_EQ(height.sigma_m, 0.02);
  const auto& position = std::get<PositionAnchor>((*read)[1]);
  EXPECT_EQ(position.p_A, Vec3(1, 2, 3));
  EXPECT_NEAR(position.covariance(1, 1), 0.04, 1e-15);
  EXPECT_EQ(std::get<PositionAnchor>((*read)[2]).p_B, Vec3(0.5, 0, 0));
  EXPECT_EQ(std::get<HeightAnchor>((*read)[3]).p_B, Vec3(0.1, 0, -0.2));
  for (const Anchor& a : *read) EXPECT_EQ(impossible(a), "");
}

TEST(AnchorFile, EveryFaultIsASentenceWithItsLine) {
  const auto complaint = [](const std::string& row) {
    const auto read = parse_anchors("1,0,0,0,1,1,1\n" + row + "\n", "p.csv");
    return read ? std::string("none") : read.error().message;
  };
  EXPECT_EQ(complaint("2,1,2,3"), "p.csv:2: 4 columns where timestamp_ns,x,y,z,sx,sy,sz or three more, px,py,pz, are expected");
  EXPECT_EQ(complaint("2,1,2,x,1,1,1"), "p.csv:2: 'x' is not a number");
  EXPECT_EQ(complaint("-5,1,2,3,1,1,1"), "p.csv:2: '-5' is not a stamp in nanoseconds");
  EXPECT_EQ(complaint("2,1,2,nan,1,1,1"), "p.csv:2: z is missing");
  EXPECT_EQ(complaint("2,1,,3,1,1,1"), "p.csv:2: one of x and y is missing: both are given, or none");
  EXPECT_EQ(complaint("2,1,2,3,1,0,1"), "p.csv:2: the standard deviation sy is not above 0");
  EXPECT_EQ(complaint("2,1,2,3,1,1,"), "p.csv:2: the standard deviation sz is not above 0");
  EXPECT_EQ(complaint("2,1,2,3,1,1,inf"), "p.csv:2: inf m is too far to be in a building");
  EXPECT_EQ(complaint("2,1,2,3,1,1,1,0,,0"), "p.csv:2: one of px, py and pz is missing");
  EXPECT_EQ(parse_anchors("# nothing\n", "p.csv").error().message, "p.csv: no positions are in it");
  EXPECT_FALSE(read_anchors("/nonexistent/p.csv"));
}

}  // namespace anchor_file_test
}  // namespace fbvins
