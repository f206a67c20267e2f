// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/partial_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace partial_pose_test {

const Pose<A, B> kT_AB(so3_exp(Vec3(0.1, -0.2, 2.0)), Vec3(4, -1, 1.5));

Vec3 noise(Rng& rng, double sigma) { return sigma * Vec3(rng.normal(), rng.normal(), rng.normal()); }

/// Mean squared whitened residual of a true pose against measurements sampled from their own covariance.
template <class Draw>
double mean_nees(Draw draw) {
  Rng rng(3);
  constexpr int kSamples = 4000;
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    const PartialPose m = draw(rng);
    const Vec6 r = residual(m, kT_AB.q, kT_AB.p);
    sum += r.dot(m.information * r) / kSamples;
  }
  return sum;
}

TEST(PartialPose, APositionIsThatOfItsPoint) {
  PositionAnchor a{.p_B = Vec3(0.1, 0.2, -0.3)};
  a.covariance.diagonal() << 0.01, 0.04, 0.09;
  a.p_A = kT_AB * a.p_B;
  const PartialPose exact = measurement_of(a);
  EXPECT_LT(residual(exact, kT_AB.q, kT_AB.p).head<3>().norm(), 1e-12);
  EXPECT_EQ(exact.information.bottomRightCorner(3, 3).norm(), 0);
  EXPECT_NEAR(mean_nees([&](Rng& rng) {
                PositionAnchor sampled = a;
                sampled.p_A += Vec3(0.1 * rng.normal(), 0.2 * rng.normal(), 0.3 * rng.normal());
                return measurement_of(sampled);
              }),
              3, 0.15);
}

TEST(PartialPose, AHeightSaysNothingElse) {
  const PartialPose m = measurement_of(HeightAnchor{.z_A_m = kT_AB.p.z() + 0.2, .sigma_m = 0.1});
  const Vec6 r = residual(m, kT_AB.q, kT_AB.p);
  EXPECT_NEAR(r.dot(m.information * r), 4, 1e-9);
}

TEST(PartialPose, ATagsErrorsBecomeTheBodysCorrelatedOnes) {
  const Pose<A, Tag> T_AT(so3_exp(Vec3(1.5, 0.2, -0.3)), Vec3(6, 0.5, 1.2));
  const Pose<B, Tag> T_BT = kT_AB.inverse() * T_AT;
  constexpr double kSigma_m = 0.02, kSigma_rad = 0.03;  // well above the floors
  TagAnchor a{.T_AT = T_AT};
  a.covariance.diagonal() << Vec3::Constant(kSigma_m * kSigma_m), Vec3::Constant(kSigma_rad * kSigma_rad);
  const double nees = mean_nees([&](Rng& rng) {
    const Vec3 dp = noise(rng, kSigma_m), dtheta = noise(rng, kSigma_rad);
    a.T_BT = T_BT.boxplus(dp, dtheta);
    return measurement_of(a);
  });
  EXPECT_GT(nees, 5.3);
  EXPECT_LT(nees, 6.3) << "6, and less by the floor";
}

TEST(PartialPose, CarriedToAnotherBodyItMeasuresTheSame) {
  const Pose<B, B> T_other_this(so3_exp(Vec3(0.2, 0.1, -0.4)), Vec3(0.5, -0.2, 0.1));
  TagAnchor tag{.T_AT = {so3_exp(Vec3(1.5, 0.2, -0.3)), Vec3(6, 0.5, 1.2)}};
  tag.T_BT = kT_AB.inverse() * tag.T_AT;
  tag.covariance *= 1e-4;
  const Pose<A, B> T_A_other = kT_AB * T_other_this.inverse();
  const PartialPose same = carried(measurement_of(tag), T_other_this, Mat6::Zero());
  EXPECT_LT(residual(same, T_A_other.q, T_A_other.p).norm(), 1e-9);
  // An error of the other body is seen alike.
  const Pose<A, B> off = T_A_other.boxplus(Vec3(0.01, 0, -0.02), Vec3(0.001, 0.002, -0.001));
  const Pose<A, B> off_here = off * T_other_this;
  const PartialPose here = measurement_of(tag);
  const Vec6 there = residual(same, off.q, off.p), now = residual(here, off_here.q, off_here.p);
  EXPECT_NEAR(there.dot(same.information * there), now.dot(here.information * now), 0.02);
  const PartialPose worse = carried(here, T_other_this, Mat6(1e-2 * Mat6::Identity()));
  EXPECT_LT(there.dot(worse.information * there), 0.1 * there.dot(same.information * there));
  const PartialPose height = carried(measurement_of(HeightAnchor{}), T_other_this, Mat6(1e-2 * Mat6::Identity()));
  EXPECT_NEAR(height.information(2, 2), 1 / 1.01, 1e-9);
  EXPECT_NEAR(height.information.norm(), height.information(2, 2), 1e-12);
}

TEST(PartialPose, WidenedAddsCovariances) {
  Rng rng(5);
  Mat6 a, L;
  for (int i = 0; i < 36; ++i) a(i / 6, i % 6) = rng.normal(), L(i / 6, i % 6) = rng.normal();
  const Mat6 cov = a * a.transpose() + 0.1 * Mat6::Identity();
  const Mat6 expected = (cov + L * L.transpose()).inverse();
  EXPECT_LT((widened(cov.inverse(), L) - expected).norm(), 1e-8 * expected.norm());
}

TEST(PartialPose, ATiltDisplacesThePointOfALeverArm) {
  PositionAnchor a{.covariance = 1e-6 * Mat3::Identity(), .p_B = Vec3(0, 0, 2)};
  a.p_A = kT_AB * a.p_B;
  const PartialPose m = measurement_of(a);
  const Vec3 up_B = kT_AB.q.conjugate() * Vec3::UnitZ();
  const Mat6 wide = widened(m.information, tilt_error(m, kT_AB.q, up_B, 0.01));
  const Quat tilted = kT_AB.q * so3_exp(kT_AB.q.conjugate() * Vec3(0.01, 0, 0));
  const Vec6 r = residual(m, tilted, kT_AB.p);
  EXPECT_GT(r.dot(m.information * r), 100);
  EXPECT_LT(r.dot(wide * r), 1.1);
}

}  // namespace partial_pose_test
}  // namespace fbvins
