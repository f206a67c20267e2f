// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/core/rng.hpp"
#include "fbvins/imu/preintegration.hpp"

namespace fbvins {
namespace place_map_test {

/// Steps of a metre and a small turn; each is one edge of the odometry.
PlaceMap chain(int keyframes) {
  const Pose<B, B> step(so3_exp(Vec3(0, 0, 0.1)), Vec3(1, 0, 0));
  PlaceMap map;
  Pose<M, B> T_MB;
  for (int i = 0; i < keyframes; ++i) {
    MapKeyframe k;
    k.T_MB = T_MB, k.T_GB = Pose<G, B>(T_MB.q, T_MB.p);
    map.add(std::move(k));
    if (i > 0) map.edges.push_back({KeyframeId{i - 1}, KeyframeId{i}, step, Mat6::Identity(), MapEdge::Kind::odometry});
    T_MB = T_MB * step;
  }
  return map;
}

/// Readings of so many seconds from `from_s` on, at rest.
std::shared_ptr<const Preintegration> rest(double from_s, double seconds) {
  ImuSegment segment;
  for (const double s : {from_s, from_s + 0.5 * seconds, from_s + seconds})
    segment.samples.push_back({Time{} + Duration::from_seconds(s), Vec3::Zero(), Vec3(0, 0, 9.81)});
  Preintegration imu({}, {});
  imu.integrate(segment);
  return std::make_shared<const Preintegration>(imu);
}

TEST(PlaceMap, ReadingsOfARemovedKeyframesTwoStepsBecomeOne) {
  PlaceMap map = chain(4);
  for (int i = 0; i < 3; ++i) map.edges[static_cast<std::size_t>(i)].imu = rest(2 * i, 2);
  map.remove(KeyframeId{1});
  ASSERT_TRUE(map.edges.back().imu);
  EXPECT_NEAR(map.edges.back().imu->dt_s(), 4, 1e-9);
  map.remove(KeyframeId{2});
  ASSERT_EQ(map.edges.size(), 1u);
  EXPECT_FALSE(map.edges.back().imu) << "six seconds constrain too little";
}

TEST(PlaceMap, AnotherBodyLeavesEachCameraWhereItWas) {
  PlaceMap map = chain(3);
  map.cameras[0] = {so3_exp(Vec3(0.1, -1.2, 0.3)), Vec3(0.01, 0.02, 0.03)};
  const Pose<B, C0> second(so3_exp(Vec3(0, 2, 0)), Vec3(0.3, 0, 0));
  map.keyframes()[1].camera = map.camera_at(second);
  EXPECT_EQ(map.camera_at(second), 1) << "it is there already";
  const PlaceMap before = map;
  const Pose<B, C0> first(so3_exp(Vec3(1, 0, 0)), Vec3(0.5, -0.2, 0));
  change_body(map, first);
  EXPECT_EQ(map.cameras[0].p, first.p);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Pose<C0, C0> moved = before.T_MC(before.keyframes()[i]).inverse() * map.T_MC(map.keyframes()[i]);
    EXPECT_LT(moved.p.norm() + moved.q.vec().norm(), 1e-12) << i;
  }
}

TEST(PlaceMap, TurnsAsAWhole) {
  PlaceMap map = chain(3);
  map.keyframes()[2].placed = false;
  const Vec3 apart = map.keyframes()[2].T_MB.p;
  const Pose<B, B> step = map.keyframes()[0].T_MB.inverse() * map.keyframes()[1].T_MB;
  const Vec3 pivot = map.keyframes()[0].T_MB.p;
  map.turn(so3_exp(Vec3(0.1, -0.2, 0)), pivot);
  EXPECT_LT((map.keyframes()[0].T_MB.p - pivot).norm(), 1e-12);
  EXPECT_LT(((map.keyframes()[0].T_MB.inverse() * map.keyframes()[1].T_MB).p - step.p).norm(), 1e-12);
  EXPECT_GT((map.keyframes()[1].T_MB.q.vec()).head<2>().norm(), 0.05);
  EXPECT_EQ(map.keyframes()[2].T_MB.p, apart) << "it is not placed in M";
}

TEST(PlaceMap, NumbersKeyframesAndFindsThem) {
  PlaceMap map = chain(3);
  EXPECT_EQ(map.find(KeyframeId{1})->id, KeyframeId{1});
  EXPECT_EQ(map.find(KeyframeId{3}), nullptr);
  EXPECT_EQ(map.find({}), nullptr);
  map.remove(KeyframeId{2});
  EXPECT_EQ(map.add({}), KeyframeId{3}) << "a number is given once";
}

TEST(PlaceMap, WhatIsRemovedIsBridgedByTheOdometryAroundIt) {
  PlaceMap map = chain(4);
  map.remove(KeyframeId{1});
  ASSERT_EQ(map.edges.size(), 2u);
  const auto bridge = std::find_if(map.edges.begin(), map.edges.end(), [](const MapEdge& e) { return e.from == KeyframeId{0}; });
  ASSERT_NE(bridge, map.edges.end());
  EXPECT_EQ(bridge->to, KeyframeId{2});
  const Pose<B, B> truth = map.find(KeyframeId{0})->T_MB.inverse() * map.find(KeyframeId{2})->T_MB;
  EXPECT_LT((bridge->T_from_to.p - truth.p).norm(), 1e-12);
  EXPECT_LT(bridge->information.trace(), Mat6::Identity().trace()) << "two steps are less certain than one";
}

TEST(PlaceMap, LoopsMoveToTheNeighbourAndSayTheSame) {
  PlaceMap map = chain(6);
  for (const auto& [from, to] : {std::pair{0, 3}, std::pair{3, 5}}) {
    const Pose<B, B> T = map.find(KeyframeId{from})->T_MB.inverse() * map.find(KeyframeId{to})->T_MB;
    map.edges.push_back({KeyframeId{from}, KeyframeId{to}, T, Mat6::Identity(), MapEdge::Kind::loop});
  }
  map.remove(KeyframeId{3});
  int loops = 0;
  for (const MapEdge& e : map.edges) {
    if (e.kind != MapEdge::Kind::loop) continue;
    ++loops;
    EXPECT_EQ(e.from, KeyframeId{2});
    const Pose<B, B> truth = map.find(e.from)->T_MB.inverse() * map.find(e.to)->T_MB;
    EXPECT_LT((e.T_from_to.p - truth.p).norm(), 1e-12);
    EXPECT_LT((e.T_from_to.q.conjugate() * truth.q).vec().norm(), 1e-12);
  }
  EXPECT_EQ(loops, 2);
}

TEST(PlaceMap, OptimisingMovesOnlyWhatIsConnectedToTheFirst) {
  PlaceMap map = chain(4);
  map.edges.pop_back();  // the last one is on its own
  map.keyframes()[2].T_MB.p.x() += 0.3;
  const Vec3 alone = map.keyframes()[3].T_MB.p, first = map.keyframes()[0].T_MB.p;
  const Vec3 truth = chain(4).keyframes()[2].T_MB.p;
  map.optimise({});
  EXPECT_LT((map.keyframes()[2].T_MB.p - truth).norm(), 1e-6);
  EXPECT_EQ(map.keyframes()[3].T_MB.p, alone);
  EXPECT_EQ(map.keyframes()[0].T_MB.p, first);
}

TEST(ComposeCovariance, AgreesWithSamples) {
  Rng rng(3);
  const Pose<B, B> ab(so3_exp(Vec3(0.3, -0.2, 0.5)), Vec3(1, 2, -0.5)), bc(so3_exp(Vec3(-0.4, 0.1, 0.2)), Vec3(0.5, -1, 2));
  Vec6 sigma_ab, sigma_bc;
  sigma_ab << 0.01, 0.02, 0.01, 0.004, 0.002, 0.003;
  sigma_bc << 0.02, 0.01, 0.01, 0.001, 0.003, 0.002;
  const auto disturbed = [&](const Pose<B, B>& T, const Vec6& sigma) {
    Vec6 d;
    for (int i = 0; i < 6; ++i) d[i] = sigma[i] * rng.normal();
    return Pose<B, B>(T.q * so3_exp(d.tail<3>()), Vec3(T.p + d.head<3>()));
  };
  const Pose<B, B> ac = ab * bc;
  Mat6 sampled = Mat6::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    const Pose<B, B> T = disturbed(ab, sigma_ab) * disturbed(bc, sigma_bc);
    Vec6 e;
    e << T.p - ac.p, so3_log(ac.q.conjugate() * T.q);
    sampled += e * e.transpose() / kSamples;
  }
  const Mat6 cov_ab = sigma_ab.cwiseAbs2().asDiagonal(), cov_bc = sigma_bc.cwiseAbs2().asDiagonal();
  const Mat6 cov = compose_covariance(ab, cov_ab, bc, cov_bc);
  EXPECT_LT((sampled - cov).norm(), 0.05 * cov.norm());
}

TEST(PlaceMap, AnchorsOfARemovedKeyframeGoToItsNeighbour) {
  PlaceMap map = chain(3);
  const auto anchor_of = [&](int i) {
    return MapAnchor{KeyframeId{i}, measurement_of(PositionAnchor{.p_A = map.keyframes()[static_cast<std::size_t>(i)].T_MB.p})};
  };
  map.add_anchor(anchor_of(0)), map.add_anchor(anchor_of(1)), map.add_anchor(anchor_of(2));
  map.remove(KeyframeId{1});
  ASSERT_EQ(map.anchors.size(), 3u);
  const MapAnchor& moved = map.anchors[1];
  const Pose<M, B>& T_MB = map.find(moved.keyframe)->T_MB;
  EXPECT_LT(residual(moved.measured, T_MB.q, T_MB.p).head<3>().norm(), 1e-9);
  EXPECT_LT(moved.measured.information(0, 0), 0.9) << "by an uncertain way";
}

TEST(PlaceMap, AnchorsOfALongTimeAreThinned) {
  PlaceMap map = chain(1);
  for (int i = 0; i < 50000; ++i) map.add_anchor({KeyframeId{0}, measurement_of(HeightAnchor{.z_A_m = static_cast<double>(i)})});
  EXPECT_LE(map.anchors.size(), 5000u);
  EXPECT_GT(map.anchors.size(), 2500u);
  EXPECT_EQ(map.anchors.back().measured.T_AB.p.z(), 49999);
}

TEST(PlaceMap, AnAnchoredOneMovesToItsAnchorsAndAnotherStays) {
  for (const bool anchored : {false, true}) {
    PlaceMap map = chain(4);
    map.anchored = anchored;
    const Pose<A, M> T_AM(so3_exp(Vec3(0, 0, 0.3)), Vec3(0.2, -0.1, 0.4));
    for (const MapKeyframe& k : map.keyframes()) {
      map.add_anchor({k.id, measurement_of(PositionAnchor{.p_A = T_AM * k.T_MB.p, .covariance = 1e-6 * Mat3::Identity()})});
    }
    const Vec3 first = map.keyframes()[0].T_MB.p;
    map.optimise({});
    if (anchored) EXPECT_LT((map.keyframes()[0].T_MB.p - T_AM * first).norm(), 1e-3);
    else EXPECT_EQ(map.keyframes()[0].T_MB.p, first);
  }
}

}  // namespace place_map_test
}  // namespace fbvins
