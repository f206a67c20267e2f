// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace map_frame_test {

Pose<G, B> body_at(const Vec3& p) { return {Quat::Identity(), p}; }

TEST(DriftOver, GrowsWithTheRootOfThePathAndALittleAtRest) {
  const DriftOptions drift{.position_m = 0.01, .yaw_rad = 0.002};
  EXPECT_NEAR(drift_over(drift, 4, 0).position_m2, 4 * 0.01 * 0.01, 1e-12);
  EXPECT_NEAR(drift_over(drift, 4, 0).yaw_rad2, 4 * 0.002 * 0.002, 1e-12);
  EXPECT_GT(drift_over(drift, 0, 1).position_m2, 0);
  EXPECT_GT(drift_over(drift, 0, 1).yaw_rad2, 0);
  EXPECT_LT(drift_over(drift, 0, 1).position_m2, drift_over(drift, 1, 0).position_m2);
}

TEST(Yaw, IsTheTurnAboutZ) {
  for (const double yaw : {-3.0, -0.4, 0.0, 1.2, 3.1}) EXPECT_NEAR(yaw_of(about_z(yaw)), yaw, 1e-12);
  EXPECT_LT((about_z(std::numbers::pi / 2) * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12);
}

TEST(MapFrame, IsUnknownUntilItIsSetAndKeepsYawAndPositionOnly) {
  MapFrame frame;
  EXPECT_FALSE(frame.known());
  frame.reset({so3_exp(Vec3(0.1, 0, 0)) * about_z(0.5), Vec3(1, 2, 3)}, 0.1, 0.01);
  EXPECT_TRUE(frame.known());
  EXPECT_NEAR((frame.T_MG().q * Vec3::UnitZ()).z(), 1, 1e-12);
  EXPECT_LT((frame.T_MG().p - Vec3(1, 2, 3)).norm(), 1e-12);
  frame.forget();
  EXPECT_FALSE(frame.known());
}

TEST(MapFrame, BetterKnownGravityTurnsItAboutTheBody) {
  MapFrame frame;
  frame.advance(body_at(Vec3(5, 0, 1)), Time{0}, {});
  frame.reset({about_z(0.5), Vec3(1, 2, 3)}, 0.1, 0.01);
  const Vec3 p_MB = frame.T_MG() * Vec3(5, 0, 1);
  const Quat q_LG = so3_exp(Vec3(0.03, -0.02, 0));
  frame.level(q_LG);
  EXPECT_LT((frame.T_MG() * Vec3(5, 0, 1) - p_MB).norm(), 1e-12);
  EXPECT_LT(so3_log(frame.T_MG().q.conjugate() * about_z(0.5) * q_LG).norm(), 1e-9);
  const Pose<M, M> T(so3_exp(Vec3(0.1, 0, 0)), Vec3(0, 1, 0));
  frame.turn(T);
  frame.level(q_LG);
  EXPECT_LT((frame.T_MG() * Vec3(5, 0, 1) - T * p_MB).norm(), 1e-12);
}

TEST(MapFrame, FlyingWidensTheCovarianceAndAPlaceNarrowsIt) {
  const DriftOptions drift{.position_m = 0.01, .yaw_rad = 0.002};
  MapFrame frame;
  frame.advance(body_at(Vec3::Zero()), Time{0}, drift);
  frame.reset({}, 0.01, 0.001);
  const Mat4 before = frame.covariance();
  frame.advance(body_at(Vec3(9, 0, 0)), Time{1'000'000'000}, drift);
  const Mat4 flown = frame.covariance();
  EXPECT_GT(flown(0, 0), before(0, 0) + 8 * 0.01 * 0.01);
  EXPECT_GT(flown(1, 1), flown(0, 0)) << "a yaw error turns the step sideways";
  EXPECT_NEAR(flown(1, 3), 9 * before(3, 3), 1e-6) << "and the two errors are correlated";
  MeasuredPose seen{{about_z(0.01), Vec3(9, 0.05, 0)}, 1e-4 * Mat4::Identity()};
  const double far = frame.mahalanobis2(seen);
  frame.update(seen);
  EXPECT_LT(frame.mahalanobis2(seen), far);
  for (int i = 0; i < 4; ++i) EXPECT_LT(frame.covariance()(i, i), flown(i, i));
  const Vec3 p = frame.T_MG() * Vec3(9, 0, 0);
  EXPECT_GT(p.y(), 0.02);
  EXPECT_LT(p.y(), 0.05);
}

/// Flies along x, a metre at a time, by an odometry whose metre is `metre` long; a place is known every third time.
MapFrame after_flight(double metre, double sigma, int metres) {
  MapFrame frame;
  frame.advance(body_at(Vec3::Zero()), Time{0}, {}, sigma);
  frame.reset({}, 0.01, 0.001);
  for (int i = 1; i <= metres; ++i) {
    frame.advance(body_at(Vec3(i, 0, 0)), Time{1'000'000'000LL * i}, {}, sigma);
    if (i % 3 != 0) continue;
    const MeasuredPose seen{{Quat::Identity(), Vec3(metre * i, 0, 0)}, 1e-4 * Mat4::Identity()};
    EXPECT_LT(frame.mahalanobis2(seen), 25) << i;
    frame.update(seen);
  }
  return frame;
}

TEST(MapFrame, LearnsTheScaleOfAFlightOfOneCamera) {
  MapFrame frame = after_flight(1.08, 0.05, 12);
  EXPECT_NEAR(frame.log_scale(), std::log(1.08), 0.01);
  frame.advance(body_at(Vec3(14, 0, 0)), Time{14'000'000'000}, {}, 0.05);
  EXPECT_NEAR((frame.T_MG() * Vec3(14, 0, 0)).x(), 1.08 * 14, 0.03);
  frame.forget();
  EXPECT_EQ(frame.log_scale(), 0);
}

TEST(MapFrame, AnUncertainScaleWidensAlongTheWay) {
  const auto after = [](double sigma) {
    MapFrame frame;
    frame.advance(body_at(Vec3::Zero()), Time{0}, {}, sigma);
    frame.reset({}, 0.01, 0.001);
    for (int i = 1; i <= 4; ++i) frame.advance(body_at(Vec3(0.5 * i, 0, 0)), Time{1'000'000'000LL * i}, {}, sigma);
    return frame.covariance();
  };
  const Mat4 more = after(0.05) - after(0);
  EXPECT_NEAR(std::sqrt(more(0, 0)), 0.05 * 2, 0.01);
  EXPECT_LT((more.bottomRightCorner<3, 3>().norm()), 1e-12);
}

TEST(MapFrame, MahalanobisIsOneAtOneStandardDeviation) {
  MapFrame frame;
  frame.advance(body_at(Vec3::Zero()), Time{0}, {});
  frame.reset({}, 0.3, 0.02);
  MeasuredPose seen{{Quat::Identity(), Vec3(0.5, 0, 0)}, Mat4::Zero()};
  seen.covariance.diagonal() << 0.16, 0.16, 0.16, 1e-4;  // 0.09 + 0.16 = 0.25
  EXPECT_NEAR(frame.mahalanobis2(seen), 1, 1e-9);
}

TEST(MapFrame, AnAnchorsGateAndUpdateAreThoseOfItsPoint) {
  const Quat q_LG = so3_exp(Vec3(0.02, -0.03, 0));
  MapFrame frame;
  frame.level(q_LG);
  frame.advance(body_at(Vec3(5, 0, 1)), Time{0}, {});
  frame.reset({about_z(0.5) * q_LG, Vec3(1, 2, 3)}, 0.3, 0.1);
  const Pose<G, B> before = body_at(Vec3(2, 1, 1));  // three metres behind
  PositionAnchor a{.p_A = frame.T_MG() * Vec3(2, 1, 1.5), .covariance = 0.16 * Mat3::Identity(), .p_B = Vec3(0, 0, 0.5)};
  EXPECT_NEAR(frame.mahalanobis2(measurement_of(a), before), 0, 1e-9);
  a.p_A.z() += 0.5;  // a standard deviation: 0.09 + 0.16
  EXPECT_NEAR(frame.mahalanobis2(measurement_of(a), before), 1, 0.01);
  const Mat4 P = frame.covariance();
  frame.update(measurement_of(a), before);
  for (int i = 0; i < 4; ++i) EXPECT_LT(frame.covariance()(i, i), P(i, i));
  EXPECT_GT(frame.T_MG().p.z(), 3.1);
  // The truth is turned by 0.1 rad about the body now: a precise point behind shows it.
  const Vec3 body_M = frame.T_MG() * Vec3(5, 0, 1);
  PositionAnchor behind{.p_A = body_M + about_z(0.1) * (frame.T_MG() * Vec3(2, 1, 1) - body_M),
                        .covariance = 1e-6 * Mat3::Identity()};
  const Quat q_before = frame.yaw();
  PositionAnchor here{.p_A = body_M, .covariance = 1e-6 * Mat3::Identity()};
  for (int i = 0; i < 5; ++i) {
    frame.update(measurement_of(here), body_at(Vec3(5, 0, 1)));
    frame.update(measurement_of(behind), before);
  }
  EXPECT_NEAR(yaw_of(frame.yaw() * q_before.conjugate()), 0.1, 0.01);
}

TEST(NearestTo, FindsTheTurnAndShiftOfPosesAndKeepsTheVertical) {
  Rng rng(3);
  const auto vector = [&](double size) { return Vec3(size * Vec3(rng.normal(), rng.normal(), rng.normal())); };
  std::vector<Pose<M, B>> wanted, poses;
  const Pose<M, M> T(about_z(0.7), Vec3(1, -2, 3));
  for (int i = 0; i < 20; ++i) {
    poses.push_back({so3_exp(vector(1)), vector(4)});
    wanted.push_back(T * poses.back());
  }
  const Pose<M, M> found = nearest_to(wanted, poses, 2);
  EXPECT_LT((found.p - T.p).norm(), 1e-9);
  EXPECT_LT(so3_log(found.q.conjugate() * T.q).norm(), 1e-9);
  EXPECT_LT((nearest_to({}, {}, 2).p).norm(), 1e-12) << "of no poses nothing is known";
  // On one spot the positions say nothing of a turn, and attitudes do.
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].p = vector(0.001), wanted[i].p = vector(0.001);
  EXPECT_NEAR(yaw_of(nearest_to(wanted, poses, 2).q), 0.7, 1e-3);
}

TEST(MapFrameFollower, MovesByABoundedAmountASecondAndArrives) {
  MapFrameFollower follower(0.2, 0.05);
  const Pose<W, B> T_WB(Quat::Identity(), Vec3(30, 0, 0));  // far from the origin: a change of yaw must not move the body
  (void)follower.follow({}, T_WB, Time{0});
  const Pose<M, W> target(so3_exp(Vec3(0, 0, 0.05)), Vec3(0.5, -1, 0));
  Vec3 before = T_WB.p;
  for (int i = 1; i <= 200; ++i) {
    const Vec3 now = follower.follow(target, T_WB, Time{i * 100'000'000LL}) * T_WB.p;
    EXPECT_LE((now - before).norm(), 0.2 * 0.1 + 1e-9);
    before = now;
  }
  EXPECT_NEAR((before - target * T_WB.p).norm(), 0, 1e-9);
}

}  // namespace map_frame_test
}  // namespace fbvins
