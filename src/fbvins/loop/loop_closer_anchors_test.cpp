// SPDX-License-Identifier: Apache-2.0
// Anchors in flights through a synthetic room: what M and the map do with them.
#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/loop/map_file.hpp"
#include "tests/support/anchored_flight.hpp"

namespace fbvins {
namespace loop_closer_anchors_test {

using namespace test_room;

TEST(AnchoredMap, WithoutEnoughMStaysWhereTheFlightBegan) {
  const auto frames = flight(room(1), 60, 0.002, 0.02, 2);
  LoopCloser closer(rig(), {}, vocabulary()), plain(rig(), {}, vocabulary());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& f = frames[i];
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, f.t, f.odometry);
    const MapUpdate expected = plain.process(f.place, k);
    k.anchors = {HeightAnchor{.t = f.t, .z_A_m = truth_of(f).p.z(), .sigma_m = 0.02}};
    if (i == 9) k.anchors.push_back(PositionAnchor{.t = f.t, .p_A = truth_of(f).p, .covariance = 1e-4 * Mat3::Identity()});
    const MapUpdate u = closer.process(f.place, k);
    EXPECT_FALSE(u.anchored || u.M_moved);
    EXPECT_EQ(u.T_MG.p, expected.T_MG.p);
    EXPECT_EQ(u.T_MG.q.coeffs(), expected.T_MG.q.coeffs());
  }
}

TEST(AnchoredMap, WhatWasKeptInMComesIntoTheBuildingWithItAlsoWhereMWasNotLevel) {
  const auto frames = flight(room(1), 60, 0, 0, 2);
  const Quat q_GL = so3_exp(Vec3(0.04, -0.03, 0));
  LoopCloser closer(rig(), {}, vocabulary());
  Rng rng(5);
  Pose<M, B> kept;
  int moves = 0;
  bool anchored = false;
  for (std::size_t i = 0; i < frames.size() && !anchored; ++i) {
    const Frame& f = frames[i];
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, f.t, {q_GL * f.odometry.q, q_GL * f.odometry.p});
    k.gauge.q_LG = so3_exp(std::min(1.0, static_cast<double>(i) / 50) * so3_log(q_GL.conjugate()));
    k.gauge.up_sigma_rad = i < 10 ? 0.02 : 0.0;
    if (i >= 10) k.anchors = {position(f, rng, 0.005)};
    const MapUpdate u = closer.process(f.place, k);
    if (u.M_moved) kept = *u.M_moved * kept, ++moves;
    if (i == 5) kept = u.T_MG * k.gauge.T_GB;
    EXPECT_EQ(u.M_moved.has_value(), i >= 10) << "with anchors M is levelled at once";
    anchored = u.anchored;
    if (!anchored) continue;
    const Pose<M, B> now = u.T_MG * k.gauge.T_GB;
    EXPECT_LT((now.p - truth_of(f).p).norm(), 0.1);
    EXPECT_LT((kept.p - truth_of(frames[5]).p).norm(), 0.1);
  }
  EXPECT_TRUE(anchored);
  EXPECT_GT(moves, 1);
}

TEST(AnchoredMap, HeightsHoldOneThatPositionsAnchored) {
  auto frames = flight(room(1), 250, 0, 0, 2);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].odometry.p.z() += 0.002 * static_cast<double>(i);  // the odometry climbs by half a metre
    frames[i].place = {};
  }
  Errors with, without;
  for (const bool heights : {false, true}) {
    Rng rng(7);
    LoopCloser closer(rig(), {}, vocabulary());
    int i = 0;
    const Flown flown = fly(closer, frames, [&](const Frame& f) -> std::vector<Anchor> {
      if (++i < 60) return {position(f, rng, 0.02)};
      if (heights) return {HeightAnchor{.t = f.t, .z_A_m = truth_of(f).p.z() + 0.02 * rng.normal(), .sigma_m = 0.02}};
      return {};
    });
    (heights ? with : without) = flown.after;
  }
  EXPECT_GT(without.m, 0.15);
  EXPECT_LT(with.m, 0.05);
}

TEST(AnchoredMap, BetweenKeyframesTheReadingsSayWhereItWas) {
  auto frames = flight(room(1), 250, 0.001, 0.01, 2);
  Rng rng(5);
  LoopCloser closer(rig(), {}, vocabulary());
  Trajectory<G> in_G;
  int refused = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, frames[i].t, frames[i].odometry);
    const Quat turned = frames[i].odometry.q * frames[i].truth.q.conjugate();
    k.gauge.v_GB = turned * true_velocity(frames[i].t.seconds());
    if (i > 0) {
      k.imu.segments = {readings(frames[i - 1].t, frames[i].t, {})};
      const double s = frames[i].t.seconds() - 0.1;
      k.anchors = {PositionAnchor{.t = Time{} + Duration::from_seconds(s),
                                  .p_A = (kT_AR * true_pose(s)).p + noise(rng, 0.01),
                                  .covariance = 1e-4 * Mat3::Identity()}};
    }
    refused += closer.process(frames[i].place, k).stats.anchors_refused;
    in_G.push_back({frames[i].t, frames[i].odometry});
  }
  closer.finish();
  EXPECT_LT(refused, 5);
  EXPECT_LT(errors(closer.corrected(in_G), frames).m, 0.008);
}

TEST(AnchoredMap, IsKeptInTheFileAndLaterFlightsAreInTheBuilding) {
  Rng rng(5);
  LoopCloser first(rig(), {}, vocabulary());
  fly(first, flight(room(1), 250, 0.001, 0.01, 2), [&](const Frame& f) { return std::vector{position(f, rng, 0.02)}; });
  const std::string bytes = serialise_map(first.map());
  auto map = parse_map(std::as_bytes(std::span(bytes)), "map");
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_TRUE(map->anchored);
  EXPECT_EQ(map->anchors.size(), first.map().anchors.size());
  EXPECT_EQ(serialise_map(*map), bytes);
  LoopCloser again(rig(), {}, vocabulary(), std::move(*map));
  const Flown flown = fly(again, flight(room(1), 100, 0.001, 0.01, 9, 7.3), [](const Frame&) { return std::vector<Anchor>{}; });
  EXPECT_EQ(flown.moved, 0);
  EXPECT_EQ(flown.before, 0);
  EXPECT_GT(flown.causal.known, 60);
  EXPECT_LT(flown.causal.m, 0.03);
  EXPECT_LT(flown.after.m, 0.02);
}

TEST(AnchoredMap, AFlightIsFoundInItByAnchorsAlone) {
  Rng rng(5);
  LoopCloser closer(rig(), {}, vocabulary());
  fly(closer, flight(room(1), 120, 0.001, 0.01, 2), [&](const Frame& f) { return std::vector{position(f, rng, 0.02)}; });
  auto elsewhere = flight(room(9), 120, 0.001, 0.01, 3, 40);  // no place looks alike
  for (Frame& f : elsewhere) f.odometry = Pose<G, G>(about_z(-1), Vec3(3, 2, 1)) * f.odometry;
  const Flown flown = fly(
      closer, elsewhere, [&](const Frame& f) { return std::vector{position(f, rng, 0.02)}; }, 1);
  EXPECT_EQ(flown.moved, 0) << "M stays";
  EXPECT_GT(flown.causal.known, 60);
  EXPECT_LT(flown.after.m, 0.02);
}

TEST(AnchoredMap, BetterKnownGravityDoesNotMoveTheBody) {
  const auto frames = flight(room(1), 150, 0.001, 0.01, 3);
  const Quat q_GL = so3_exp(Vec3(0.02, -0.015, 0));
  Rng rng(8);
  LoopCloser closer(rig(), {}, vocabulary());
  Errors e;
  Trajectory<M> causal;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& f = frames[i];
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, f.t, {q_GL * f.odometry.q, q_GL * f.odometry.p});
    k.gauge.q_LG = so3_exp(std::min(1.0, static_cast<double>(i) / 100) * so3_log(q_GL.conjugate()));
    k.anchors = {position(f, rng, 0.02)};
    const MapUpdate u = closer.process(f.place, k);
    if (u.anchored) causal.push_back({f.t, u.T_MG * k.gauge.T_GB});
  }
  e = errors(causal, frames);
  EXPECT_GT(e.known, 100);
  EXPECT_LT(e.m, 0.04);
}

TEST(AnchoredMap, SameInputSameBytes) {
  const auto frames = flight(room(1), 100, 0.004, 0.05, 3);
  std::string bytes[2];
  for (std::string& b : bytes) {
    Rng rng(5);
    LoopCloser closer(rig(), {}, vocabulary());
    fly(closer, frames, [&](const Frame& f) { return std::vector{position(f, rng, 0.05)}; });
    b = serialise_map(closer.map());
  }
  EXPECT_EQ(bytes[0], bytes[1]);
}

TEST(AnchoredMap, ThinningHandsAnchorsToNeighbours) {
  Rng rng(5);
  LoopOptions options;
  options.max_keyframes = 60;
  LoopCloser closer(rig(), options, vocabulary());
  const Flown flown =
      fly(closer, flight(room(1), 250, 0.004, 0.05, 2), [&](const Frame& f) { return std::vector{position(f, rng, 0.05)}; });
  EXPECT_EQ(closer.map().size(), 60u);
  EXPECT_EQ(closer.map().anchors.size(), 250u);
  EXPECT_LT(flown.after.m, 0.04);
}

}  // namespace loop_closer_anchors_test
}  // namespace fbvins
