// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/relocaliser.hpp"

#include <gtest/gtest.h>

#include "fbvins/loop/map_frame.hpp"

namespace fbvins {
namespace relocaliser_test {

const Quat kLevel = Quat::Identity();
const Pose<M, G> kTruth(about_z(1.1), Vec3(3, -2, 0.5));

MapKeyframe query(double t_s, const Vec3& p_GB) {
  MapKeyframe k;
  k.t = Time{static_cast<std::int64_t>(t_s * 1e9)};
  k.T_GB = {so3_exp(Vec3(0.1, -0.2, 0.3)), p_GB};
  return k;
}

VerifiedPose seen_with(int inliers, int visible) {
  VerifiedPose v;
  v.pose.inliers.resize(static_cast<std::size_t>(inliers));
  v.visible = visible;
  return v;
}

TEST(Relocaliser, TwoKeyframesThatAgreeAreAccepted) {
  Relocaliser relocaliser;
  const MapKeyframe first = query(0, Vec3(1, 0, 1)), second = query(1, Vec3(2, 1, 1));
  EXPECT_FALSE(relocaliser.consider(first, kLevel, kTruth * first.T_GB, seen_with(40, 100)));
  const auto T_MG = relocaliser.consider(second, kLevel, kTruth * second.T_GB, seen_with(40, 100));
  ASSERT_TRUE(T_MG);
  EXPECT_LT((T_MG->p - kTruth.p).norm(), 0.01);
  EXPECT_NEAR(yaw_of(T_MG->q), 1.1, 0.01);
  EXPECT_NEAR((T_MG->q * Vec3::UnitZ()).z(), 1, 1e-12) << "G is level, and so is M";
}

TEST(Relocaliser, TwoThatDifferAreNot) {
  Relocaliser relocaliser;
  const MapKeyframe first = query(0, Vec3(1, 0, 1)), second = query(1, Vec3(2, 1, 1)), third = query(2, Vec3(2, 2, 1));
  EXPECT_FALSE(relocaliser.consider(first, kLevel, kTruth * first.T_GB, seen_with(40, 100)));
  Pose<M, B> elsewhere = kTruth * second.T_GB;
  elsewhere.p.x() += 0.3;
  EXPECT_FALSE(relocaliser.consider(second, kLevel, elsewhere, seen_with(40, 100)));
  Pose<M, B> turned = kTruth * third.T_GB;
  turned.q = about_z(0.1) * turned.q;
  EXPECT_FALSE(relocaliser.consider(third, kLevel, turned, seen_with(40, 100)));
}

TEST(Relocaliser, OneKeyframeDoesNotAgreeWithItself) {
  Relocaliser relocaliser;
  const MapKeyframe k = query(0, Vec3(1, 0, 1));
  EXPECT_FALSE(relocaliser.consider(k, kLevel, kTruth * k.T_GB, seen_with(40, 100)));
  EXPECT_FALSE(relocaliser.consider(k, kLevel, kTruth * k.T_GB, seen_with(40, 100)));
}

TEST(Relocaliser, AGuessIsForgotten) {
  Relocaliser relocaliser;
  const MapKeyframe first = query(0, Vec3(1, 0, 1)), late = query(6, Vec3(2, 1, 1)), next = query(7, Vec3(2, 1, 1));
  EXPECT_FALSE(relocaliser.consider(first, kLevel, kTruth * first.T_GB, seen_with(40, 100)));
  EXPECT_FALSE(relocaliser.consider(late, kLevel, kTruth * late.T_GB, seen_with(40, 100)));
  relocaliser.forget();
  EXPECT_FALSE(relocaliser.consider(next, kLevel, kTruth * next.T_GB, seen_with(40, 100)));
}

TEST(Relocaliser, OneBeyondDoubtIsEnough) {
  const MapKeyframe k = query(0, Vec3(1, 0, 1));
  EXPECT_TRUE(Relocaliser().consider(k, kLevel, kTruth * k.T_GB, seen_with(120, 300)));
  EXPECT_FALSE(Relocaliser().consider(k, kLevel, kTruth * k.T_GB, seen_with(120, 400))) << "too much of the view is missing";
}

TEST(Relocaliser, AGaugeThatIsNotLevelIsTurnedLevel) {
  const Quat q_LG = so3_exp(Vec3(0.04, -0.03, 0));
  const Pose<M, G> truth(about_z(1.1) * q_LG, Vec3(3, -2, 0.5));
  const MapKeyframe k = query(0, Vec3(1, 0, 1));
  Pose<M, B> T_MB = truth * k.T_GB;
  T_MB.q = so3_exp(Vec3(0.005, 0, 0)) * T_MB.q;  // the visual pose errs in roll, q_LG does not
  const auto T_MG = Relocaliser().consider(k, q_LG, T_MB, seen_with(120, 300));
  ASSERT_TRUE(T_MG);
  EXPECT_LT(so3_log(T_MG->q.conjugate() * truth.q).norm(), 1e-3);
  EXPECT_LT((*T_MG * k.T_GB.p - T_MB.p).norm(), 1e-12);
}

}  // namespace relocaliser_test
}  // namespace fbvins
