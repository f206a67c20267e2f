// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/anchor.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace fbvins {
namespace anchor_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Anchor, WhatIsUsableIsSaid) {
  EXPECT_EQ(impossible(PositionAnchor{}), "");
  EXPECT_EQ(impossible(HeightAnchor{}), "");
  EXPECT_EQ(impossible(TagAnchor{}), "");
  EXPECT_NE(impossible(PositionAnchor{.t = Time{5}, .p_A = Vec3(0, kNan, 0)}).find("5 ns"), std::string::npos);
  EXPECT_NE(impossible(PositionAnchor{.covariance = -Mat3::Identity()}), "");
  Mat3 lopsided = Mat3::Identity();
  lopsided(0, 1) = 0.5;
  EXPECT_NE(impossible(PositionAnchor{.covariance = lopsided}), "");
  EXPECT_NE(impossible(HeightAnchor{.sigma_m = 0}), "");
  EXPECT_NE(impossible(HeightAnchor{.z_A_m = kNan}), "");
  EXPECT_NE(impossible(TagAnchor{.T_BT = {Quat(2, 0, 0, 0), Vec3(0, 0, 1)}}), "");
  EXPECT_NE(impossible(TagAnchor{.covariance = Mat6::Zero()}), "");
  EXPECT_NE(impossible(TagAnchor{.T_AT = {Quat::Identity(), Vec3(1, kNan, 0)}}), "");
  const TagAnchor landmark{.T_AT = unknown_place()};
  EXPECT_EQ(impossible(landmark), "");
  EXPECT_TRUE(!landmark.has_place() && TagAnchor{}.has_place());
}

}  // namespace anchor_test
}  // namespace fbvins
