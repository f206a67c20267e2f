// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/published_pose.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace published_pose_test {

constexpr double kStep_m = 0.003;
constexpr double kStep_rad = 0.1 * 3.14159265358979323846 / 180;
constexpr double kPending_m = 0.1;

/// Poses of a body that flies a curve, two metres a second, at 20 Hz.
Pose<W, B> flown(int k) {
  const double s = 0.05 * k;
  return {so3_exp(Vec3(0.2 * std::sin(s), 0.1, 0.5 * s)), Vec3(2 * s, std::sin(s), 1)};
}

Pose<B, B> motion(int k) { return flown(k - 1).inverse() * flown(k); }

NavState<W> at(const Pose<W, B>& T) { return {T, Vec3(2, 0.5, 0), {}}; }

double angle(const Quat& a, const Quat& b) { return so3_log((a.conjugate() * b).normalized()).norm(); }

TEST(PublishedPose, IsTheWindowsWhereNothingIsCorrected) {
  PublishedPose published(kStep_m, kPending_m);
  for (int k = 0; k < 50; ++k) {
    published.follow(motion(k), flown(k));
    EXPECT_LT((published.T_WB().p - flown(k).p).norm(), 1e-12);
    EXPECT_LT(angle(published.T_WB().q, flown(k).q), 1e-12);
  }
}

/// All that is corrected at frame 10: W was turned by two degrees and moved by 35 mm.
const Pose<W, W> kCorrection{so3_exp(Vec3(0.03, -0.02, 0)), Vec3(0.02, -0.025, 0.015)};

TEST(PublishedPose, NoFrameAddsMoreThanTheStepToTheMotion) {
  PublishedPose published(kStep_m, kPending_m);
  double largest_m = 0, largest_rad = 0;
  for (int k = 0; k < 120; ++k) {
    const Pose<W, B> before = published.T_WB();
    published.follow(motion(k), k < 10 ? flown(k) : kCorrection * flown(k));
    if (k == 0) continue;
    const Pose<W, B> moved = before * motion(k);
    largest_m = std::max(largest_m, (published.T_WB().p - moved.p).norm());
    largest_rad = std::max(largest_rad, angle(moved.q, published.T_WB().q));
  }
  EXPECT_NEAR(largest_m, kStep_m, 1e-12) << "the limit is used";
  EXPECT_NEAR(largest_rad, kStep_rad, 1e-12);
  EXPECT_LT((published.T_WB().p - (kCorrection * flown(119)).p).norm(), 1e-9) << "nothing is pending";
  EXPECT_LT(angle(published.T_WB().q, (kCorrection * flown(119)).q), 1e-9);
  EXPECT_LT(published.pending().norm(), 1e-9);
}

TEST(PublishedPose, TurningLevelDoesNotMoveIt) {
  PublishedPose published(kStep_m, kPending_m);
  published.follow({}, flown(0));
  const Pose<W, B> level{so3_exp(Vec3(0.03, 0, 0)) * flown(1).q, flown(1).p};  // turned about where the body is
  published.follow(motion(1), level);
  EXPECT_LT((published.T_WB().p - flown(1).p).norm(), 1e-12);
  EXPECT_NEAR(angle(published.T_WB().q, level.q), 0.03 - kStep_rad, 1e-9);
}

TEST(PublishedPose, VelocityIsThatOfTheMotionInTheAxesOfThePose) {
  PublishedPose published(kStep_m, kPending_m);
  published.follow({}, flown(0));
  Odometry o;
  o.pose_covariance = 1e-6 * Mat6::Identity();
  o.velocity_covariance = 1e-4 * Mat3::Identity();
  const NavState<W> level = at(kCorrection * flown(1));
  published.follow(motion(1), level.T_FB);
  published.fill(level, o);
  EXPECT_LT((o.T_WB.q.conjugate() * o.v_WB - level.T_FB.q.conjugate() * level.v_FB).norm(), 1e-12);
  EXPECT_LT((o.T_WB.q.conjugate() * o.up_W - level.T_FB.q.conjugate() * Vec3::UnitZ()).norm(), 1e-12);
}

TEST(PublishedPose, CovarianceIncludesThePendingCorrection) {
  PublishedPose published(kStep_m, kPending_m);
  published.follow({}, flown(0));
  double first_sigma = 0, last_sigma = 0;
  for (int k = 1; k < 60; ++k) {
    Odometry o;
    o.pose_covariance = 1e-6 * Mat6::Identity();
    o.velocity_covariance = 1e-4 * Mat3::Identity();
    const NavState<W> level = at(kCorrection * flown(k));
    published.follow(motion(k), level.T_FB);
    published.fill(level, o);
    Vec6 error;  // if the window is right
    error << level.T_FB.p - o.T_WB.p, so3_log((o.T_WB.q.conjugate() * level.T_FB.q).normalized());
    EXPECT_LE(error.dot(o.pose_covariance.inverse() * error), 1) << k;
    const Vec3 v_error = level.v_FB - o.v_WB;
    EXPECT_LE(v_error.dot(o.velocity_covariance.inverse() * v_error), 1) << k;
    EXPECT_GE(o.tilt_sigma_rad, 1e-3 - 1e-12);
    EXPECT_EQ(o.level, o.tilt_sigma_rad < kLevelSigma_rad);
    last_sigma = o.tilt_sigma_rad;
    if (k == 1) first_sigma = last_sigma;
  }
  EXPECT_GT(first_sigma, 0.03);
  EXPECT_NEAR(last_sigma, 1e-3, 1e-9);
}

TEST(PublishedPose, ARestartBeginsAtTheWindowsPose) {
  PublishedPose published(kStep_m, kPending_m);
  published.follow({}, flown(0));
  published.restart();
  published.follow(motion(1), kCorrection * flown(1));
  EXPECT_EQ(published.T_WB().p, (kCorrection * flown(1)).p);
  EXPECT_TRUE(published.pending().isZero(0));
}

TEST(PublishedPose, WithoutALimitCorrectionsAreAppliedAtOnce) {
  PublishedPose published(0, kPending_m);
  published.follow({}, flown(0));
  published.follow(motion(1), kCorrection * flown(1));
  EXPECT_EQ(published.T_WB().p, (kCorrection * flown(1)).p);
}

TEST(PublishedPose, ALargeCorrectionIsTooMuchToPaySlowly) {
  for (const double degrees : {2.0, 4.0})
    for (const double shift_m : {0.08, 0.12}) {
      PublishedPose published(kStep_m, kPending_m);
      published.follow({}, flown(0));
      published.follow(motion(1), Pose<W, W>{so3_exp(Vec3(0, 0, degrees * kDegree)), Vec3(shift_m, 0, 0)} * flown(1));
      EXPECT_EQ(published.pending_too_large(), degrees > 3.1 || shift_m > 0.103) << degrees << " " << shift_m;
      EXPECT_FALSE(published.pending_too_large(1.5));
    }
  PublishedPose at_once(0, kPending_m);
  at_once.follow({}, flown(0));
  at_once.follow(motion(1), kCorrection * flown(1));
  EXPECT_FALSE(at_once.pending_too_large());
}

}  // namespace published_pose_test
}  // namespace fbvins
