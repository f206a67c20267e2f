// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/relocaliser.hpp"

#include <gtest/gtest.h>

#include "fbvins/loop/map_frame.hpp"

namespace fbvins {
namespace {

const Pose<M, W> kTruth(about_z(1.1), Vec3(3, -2, 0.5));

MapKeyframe query(double t_s, const Vec3& p_WB) {
  MapKeyframe k;
  k.t = Time{static_cast<std::int64_t>(t_s * 1e9)};
  k.T_WB = {so3_exp(Vec3(0.1, -0.2, 0.3)), p_WB};
  return k;
}

VerifiedPose seen_with(int inliers, int visible) {
  VerifiedPose v;
  v.pose.inliers.resize(static_cast<std::size_t>(inliers));
  v.visible = visible;
  return v;
}

TEST(Relocaliser, TwoKeyframesThatAgreeAreBelieved) {
  Relocaliser relocaliser;
  const MapKeyframe first = query(0, Vec3(1, 0, 1)), second = query(1, Vec3(2, 1, 1));
  EXPECT_FALSE(relocaliser.consider(first, kTruth * first.T_WB, seen_with(40, 100)));
  const auto T_MW = relocaliser.consider(second, kTruth * second.T_WB, seen_with(40, 100));
  ASSERT_TRUE(T_MW);
  EXPECT_LT((T_MW->p - kTruth.p).norm(), 0.01);
  EXPECT_NEAR(yaw_of(T_MW->q), 1.1, 0.01);
  EXPECT_NEAR((T_MW->q * Vec3::UnitZ()).z(), 1, 1e-12) << "W and M share the vertical";
}

TEST(Relocaliser, TwoThatDifferAreNot) {
  Relocaliser relocaliser;
  const MapKeyframe first = query(0, Vec3(1, 0, 1)), second = query(1, Vec3(2, 1, 1)), third = query(2, Vec3(2, 2, 1));
  EXPECT_FALSE(relocaliser.consider(first, kTruth * first.T_WB, seen_with(40, 100)));
  Pose<M, B> elsewhere = kTruth * second.T_WB;
  elsewhere.p.x() += 0.3;
  EXPECT_FALSE(relocaliser.consider(second, elsewhere, seen_with(40, 100)));
  Pose<M, B> turned = kTruth * third.T_WB;
  turned.q = about_z(0.1) * turned.q;
  EXPECT_FALSE(relocaliser.consider(third, turned, seen_with(40, 100)));
}

TEST(Relocaliser, OneKeyframeDoesNotAgreeWithItself) {
  Relocaliser relocaliser;
  const MapKeyframe k = query(0, Vec3(1, 0, 1));
  EXPECT_FALSE(relocaliser.consider(k, kTruth * k.T_WB, seen_with(40, 100)));
  EXPECT_FALSE(relocaliser.consider(k, kTruth * k.T_WB, seen_with(40, 100)));
}

TEST(Relocaliser, AGuessIsForgotten) {
  Relocaliser relocaliser;
  const MapKeyframe first = query(0, Vec3(1, 0, 1)), late = query(6, Vec3(2, 1, 1)), next = query(7, Vec3(2, 1, 1));
  EXPECT_FALSE(relocaliser.consider(first, kTruth * first.T_WB, seen_with(40, 100)));
  EXPECT_FALSE(relocaliser.consider(late, kTruth * late.T_WB, seen_with(40, 100)));
  relocaliser.forget();
  EXPECT_FALSE(relocaliser.consider(next, kTruth * next.T_WB, seen_with(40, 100)));
}

TEST(Relocaliser, OneBeyondDoubtIsEnough) {
  const MapKeyframe k = query(0, Vec3(1, 0, 1));
  EXPECT_TRUE(Relocaliser().consider(k, kTruth * k.T_WB, seen_with(120, 300)));
  EXPECT_FALSE(Relocaliser().consider(k, kTruth * k.T_WB, seen_with(120, 400))) << "too much of the view is missing";
}

}  // namespace
}  // namespace fbvins
