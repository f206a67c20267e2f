// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_edges.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace map_edges_test {

const Pose<B, C0> kCamera(so3_exp(Vec3(-1.2, 1.1, -1.3)), Vec3(0.05, -0.02, 0.1)),
    kOther(so3_exp(Vec3(1.3, -0.4, 2)), Vec3(-0.1, 0.03, 0));

TEST(AngleBetween, IsTheSameForBothQuaternionsOfARotation) {
  const Quat a = so3_exp(Vec3(0.1, 0.2, 0.3)), b = a * so3_exp(Vec3(0, 0, 0.4));
  EXPECT_NEAR(angle_between(a, b), 0.4, 1e-9);
  EXPECT_NEAR(angle_between(a, Quat(-b.coeffs())), 0.4, 1e-9);
  EXPECT_NEAR(angle_between(a, a), 0, 1e-7);
}

TEST(OdometryEdge, MeasuresTheStepWithTheDriftOfItsLength) {
  MapKeyframe from;
  from.id = KeyframeId{4};
  from.T_GB = {so3_exp(Vec3(0, 0, 1)), Vec3(1, 2, 3)};
  const Pose<B, B> step(so3_exp(Vec3(0.1, 0, 0.2)), Vec3(0.6, 0, 0.8));
  const DriftOptions drift;
  const MapEdge edge = odometry_edge(from, from.T_GB * step, from.t, drift);
  EXPECT_EQ(edge.from, KeyframeId{4});
  EXPECT_EQ(edge.kind, MapEdge::Kind::odometry);
  EXPECT_LT((edge.T_from_to.p - step.p).norm(), 1e-12);
  EXPECT_NEAR(1 / std::sqrt(edge.information(0, 0)), drift.position_m, 0.05 * drift.position_m);
  EXPECT_NEAR(1 / std::sqrt(edge.information(5, 5)), drift.yaw_rad, 0.05 * drift.yaw_rad);
}

TEST(LoopEdge, IsThePoseOfTheBodyAndPutsItWhereItIs) {
  MapKeyframe candidate;
  candidate.id = KeyframeId{7};
  candidate.T_MB = {so3_exp(Vec3(0.02, 0.01, 2)), Vec3(4, 5, 6)};
  const Pose<M, B> T_MB_query(so3_exp(Vec3(0, 0.05, 2.2)), Vec3(4.5, 4.8, 6.1));
  RelativePose pose;
  pose.T_qc = (T_MB_query * kOther).inverse() * (candidate.T_MB * kCamera);
  pose.information = 1e4 * Mat6::Identity();
  const MapEdge edge = loop_edge(kCamera, kOther, candidate.id, pose);
  EXPECT_EQ(edge.from, candidate.id);
  EXPECT_EQ(edge.kind, MapEdge::Kind::loop);
  EXPECT_LT(((candidate.T_MB * edge.T_from_to).p - T_MB_query.p).norm(), 1e-9);
  const MeasuredPose seen = measured_pose(candidate, edge);
  EXPECT_LT((seen.T_MB.p - T_MB_query.p).norm(), 1e-12);
  EXPECT_LT(angle_between(seen.T_MB.q, T_MB_query.q), 1e-6);
  EXPECT_NEAR(seen.tilt_variance_rad2, edge.information.inverse()(3, 3), 1e-9) << "its attitude is as certain about every axis";
}

TEST(LoopEdge, ItsCovarianceIsThatOfTheCamerasTwiceOverAndMoreFromAfar) {
  // Errors of the camera's pose, carried to the body's by the poses themselves.
  RelativePose pose;
  pose.T_qc = {so3_exp(Vec3(0.2, -0.3, 0.1)), Vec3(0.4, -0.2, 0.3)};
  Vec6 sigma;
  sigma << 0.02, 0.03, 0.02, 0.01, 0.02, 0.015;
  pose.information = Mat6(sigma.cwiseAbs2().cwiseInverse().asDiagonal());
  const MapEdge edge = loop_edge(kCamera, kOther, {}, pose);
  const double times = std::sqrt(2 * (1 + pose.T_qc.p.squaredNorm() / 0.49));
  Rng rng(2);
  Mat6 sampled = Mat6::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    Vec6 d;
    for (int j = 0; j < 6; ++j) d[j] = times * sigma[j] * rng.normal();
    RelativePose disturbed = pose;
    disturbed.T_qc = pose.T_qc.boxplus(d.head<3>(), d.tail<3>());
    const Pose<B, B> T = loop_edge(kCamera, kOther, {}, disturbed).T_from_to;
    Vec6 e;
    e << T.p - edge.T_from_to.p, so3_log(edge.T_from_to.q.conjugate() * T.q);
    sampled += e * e.transpose() / kSamples;
  }
  const Mat6 covariance = edge.information.inverse();
  EXPECT_LT((sampled - covariance).norm(), 0.06 * covariance.norm());
}

TEST(LoopEdge, NoLoopIsCertain) {
  RelativePose pose;
  pose.information = 1e12 * Mat6::Identity();
  const Mat6 covariance = loop_edge(kCamera, kCamera, {}, pose).information.inverse();
  EXPECT_GT(std::sqrt(covariance(0, 0)), 0.005);
  EXPECT_GT(std::sqrt(covariance(5, 5)), 0.0015);
}

}  // namespace map_edges_test
}  // namespace fbvins
