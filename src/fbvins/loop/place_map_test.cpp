// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

/// Steps of a metre and a small turn; each is one edge of the odometry.
PlaceMap chain(int keyframes) {
  const Pose<B, B> step(so3_exp(Vec3(0, 0, 0.1)), Vec3(1, 0, 0));
  PlaceMap map;
  Pose<M, B> T_MB;
  for (int i = 0; i < keyframes; ++i) {
    MapKeyframe k;
    k.T_MB = T_MB, k.T_WB = Pose<W, B>(T_MB.q, T_MB.p);
    map.add(std::move(k));
    if (i > 0) map.edges.push_back({KeyframeId{i - 1}, KeyframeId{i}, step, Mat6::Identity(), MapEdge::Kind::odometry});
    T_MB = T_MB * step;
  }
  return map;
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

TEST(PlaceMap, OptimisingMovesWhatHangsTogetherWithTheFirstOnly) {
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

TEST(ComposeCovariance, IsWhatSamplesSay) {
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

}  // namespace
}  // namespace fbvins
