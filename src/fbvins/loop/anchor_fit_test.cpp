// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/anchor_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace anchor_fit_test {

const Quat kTurn = about_z(2.3);
const Vec3 kShift(12, -7, 3);

Vec3 noise(Rng& rng, double sigma) { return sigma * Vec3(rng.normal(), rng.normal(), rng.normal()); }

/// Pose i of a walk along x of `length_m`, in the level frame.
AnchoredPose walk(int i, int n, double length_m) {
  return {about_z(0.1 * i) * so3_exp(Vec3(0.05, -0.03, 0)), Vec3(length_m * i / n, 0.2 * std::sin(i), 1), {}, KeyframeId{i}};
}

AnchoredPose with_position(AnchoredPose pose, Rng& rng, double sigma_m) {
  pose.measured = measurement_of(PositionAnchor{.p_A = kShift + kTurn * pose.p_XB + noise(rng, sigma_m),
                                                .covariance = sigma_m * sigma_m * Mat3::Identity()});
  return pose;
}

AnchoredPose with_tag(AnchoredPose pose, Rng& rng, double sigma_m, double sigma_rad) {
  const Pose<A, B> T_AB(kTurn * pose.q_XB, kShift + kTurn * pose.p_XB);
  TagAnchor a{.T_AT = T_AB * Pose<B, Tag>(so3_exp(Vec3(0, 0.3, 0)), Vec3(2, 0.4, 0.1))};
  a.T_BT = (T_AB.inverse() * a.T_AT).boxplus(noise(rng, sigma_m), noise(rng, sigma_rad));
  a.covariance.diagonal() << Vec3::Constant(sigma_m * sigma_m), Vec3::Constant(sigma_rad * sigma_rad);
  pose.measured = measurement_of(a);
  return pose;
}

double error_m(const AnchorFit& fit, const Vec3& p_X) { return (fit.q_AX * p_X + fit.p_AX - kTurn * p_X - kShift).norm(); }
double error_rad(const AnchorFit& fit) { return so3_log(fit.q_AX.conjugate() * kTurn).norm(); }

TEST(FitAnchors, PositionsAtADistanceGiveTheHeading) {
  Rng rng(1);
  std::vector<AnchoredPose> poses;
  for (int i = 0; i < 40; ++i) poses.push_back(with_position(walk(i, 40, 5), rng, 0.1));
  const auto fit = fit_anchors(poses, Vec3(5, 0, 1));
  ASSERT_TRUE(fit);
  EXPECT_LT(error_m(*fit, Vec3(5, 0, 1)), 0.12);
  EXPECT_LT(error_rad(*fit), 0.04);
  EXPECT_GT(fit->inliers, 35);
}

TEST(FitAnchors, TagsGiveItAtOnePlace) {
  Rng rng(2);
  std::vector<AnchoredPose> poses;
  for (int i = 0; i < 6; ++i) poses.push_back(with_tag(walk(i, 1000, 1), rng, 0.01, 0.02));
  const auto fit = fit_anchors(poses, Vec3(0, 0, 1));
  ASSERT_TRUE(fit);
  EXPECT_LT(error_m(*fit, Vec3(0, 0, 1)), 0.05);
  EXPECT_LT(error_rad(*fit), 0.04);
}

TEST(FitAnchors, AVerticalThatIsUncertainDoesNotContradictTags) {
  Rng rng(2);
  std::vector<AnchoredPose> poses;
  for (int i = 0; i < 4; ++i) {
    poses.push_back(with_tag(walk(i, 1000, 1), rng, 0.002, 0.003));
    poses.back().q_XB = so3_exp(Vec3(0.05, 0, 0)) * poses.back().q_XB;
  }
  EXPECT_FALSE(fit_anchors(poses, Vec3(0, 0, 1)));
  for (AnchoredPose& pose : poses) pose.tilt_rad = 2 * 0.03;  // shared by four
  const auto fit = fit_anchors(poses, Vec3(0, 0, 1));
  ASSERT_TRUE(fit);
  EXPECT_LT(error_m(*fit, Vec3(0, 0, 1)), 0.05);
  EXPECT_LT(error_rad(*fit), 0.02);
}

TEST(FitAnchors, OutliersAreLeftOut) {
  Rng rng(3);
  std::vector<AnchoredPose> poses;
  for (int i = 0; i < 40; ++i) {
    poses.push_back(with_position(walk(i, 40, 5), rng, 0.05));
    if (i % 4 == 0) poses.back().measured.T_AB.p += noise(rng, 3);
  }
  const auto fit = fit_anchors(poses, Vec3(5, 0, 1));
  ASSERT_TRUE(fit);
  EXPECT_LT(error_m(*fit, Vec3(5, 0, 1)), 0.06);
  EXPECT_NEAR(fit->inliers, 30, 2);
}

TEST(FitAnchors, WhatDoesNotDetermineItGivesNothing) {
  Rng rng(4);
  std::vector<AnchoredPose> at_a_spot, one, scattered, heights;
  for (int i = 0; i < 40; ++i) at_a_spot.push_back(with_position(walk(i, 4000, 5), rng, 0.1));
  EXPECT_FALSE(fit_anchors(at_a_spot, Vec3::Zero())) << "no heading";
  for (int i = 0; i < 5; ++i) one.push_back(with_tag(walk(3, 40, 5), rng, 0.01, 0.02));
  EXPECT_FALSE(fit_anchors(one, Vec3::Zero())) << "of one keyframe, which may be wrong";
  for (int i = 0; i < 40; ++i) {
    scattered.push_back(with_position(walk(i, 40, 5), rng, 0.05));
    scattered.back().measured.T_AB.p += noise(rng, 3);
  }
  EXPECT_FALSE(fit_anchors(scattered, Vec3::Zero())) << "they do not agree";
  for (int i = 0; i < 40; ++i) {
    heights.push_back(walk(i, 40, 5));
    heights.back().measured = measurement_of(HeightAnchor{.z_A_m = 4, .sigma_m = 0.01});
  }
  EXPECT_FALSE(fit_anchors(heights, Vec3::Zero()));
  EXPECT_FALSE(fit_anchors({}, Vec3::Zero()));
}

TEST(FitAnchors, TheCovarianceIsThatOfTheResult) {
  double nees = 0;
  constexpr int kRuns = 60;
  for (int k = 0; k < kRuns; ++k) {
    Rng rng(100 + static_cast<std::uint64_t>(k));
    std::vector<AnchoredPose> poses;
    for (int i = 0; i < 30; ++i) poses.push_back(with_position(walk(i, 30, 6), rng, 0.1));
    const auto fit = fit_anchors(poses, Vec3(6, 0, 1));
    ASSERT_TRUE(fit);
    Vec4 e;
    e << fit->q_AX * Vec3(6, 0, 1) + fit->p_AX - kTurn * Vec3(6, 0, 1) - kShift, yaw_of(fit->q_AX * kTurn.conjugate());
    nees += e.dot(fit->covariance.inverse() * e) / kRuns;
  }
  EXPECT_GT(nees, 2.8);
  EXPECT_LT(nees, 5.2);
}

}  // namespace anchor_fit_test
}  // namespace fbvins
