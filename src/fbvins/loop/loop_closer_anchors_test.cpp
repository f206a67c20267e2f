// SPDX-License-Identifier: Apache-2.0
// Anchors in flights through a synthetic room: M becomes the building's frame, wrong ones change nothing, maps keep it.
#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/test_room.hpp"

namespace fbvins {
namespace {

using namespace test_room;

/// The building's frame is not the room's.
const Pose<A, G> kT_AR(about_z(2.4), Vec3(20, -8, 3));
const Vec3 kAntenna_B(0.05, 0, 0.12);

Pose<A, B> truth_of(const Frame& f) { return kT_AR * f.truth; }
Vec3 noise(Rng& rng, double sigma) { return sigma * Vec3(rng.normal(), rng.normal(), rng.normal()); }

Anchor position(const Frame& f, Rng& rng, double sigma_m) {
  return PositionAnchor{.t = f.t,
                        .p_A = truth_of(f) * kAntenna_B + noise(rng, sigma_m),
                        .covariance = sigma_m * sigma_m * Mat3::Identity(),
                        .p_B = kAntenna_B};
}

/// Three tags on the room's walls; `named` is the number that the detector reads.
std::vector<Pose<A, Tag>> tags() {
  std::vector<Pose<A, Tag>> out;
  for (const auto& [yaw, p] :
       {std::pair(-1.57, Vec3(4, 0.5, 1.4)), std::pair(0.0, Vec3(0.4, 3, 1.6)), std::pair(1.57, Vec3(-4, -0.4, 1.2))})
    out.push_back(kT_AR * Pose<G, Tag>(about_z(yaw) * so3_exp(Vec3(M_PI / 2, 0, 0)), p));
  return out;
}

/// The tags in front of the camera, nearer than 6 m.
std::vector<Anchor> seen_tags(const Frame& f, Rng& rng, double wrong_share) {
  std::vector<Anchor> out;
  const std::vector<Pose<A, Tag>> all = tags();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Pose<B, Tag> T_BT = truth_of(f).inverse() * all[i];
    if (T_BT.p.x() < 0.7 * T_BT.p.norm() || T_BT.p.norm() > 6) continue;
    TagAnchor a{.t = f.t, .id = static_cast<int>(i), .T_AT = all[i], .T_BT = T_BT.boxplus(noise(rng, 0.01), noise(rng, 0.02))};
    a.covariance.diagonal() << Vec3::Constant(1e-4), Vec3::Constant(4e-4);
    if (rng.uniform() < wrong_share)
      a.id = static_cast<int>((i + 1 + rng.below(2)) % 3), a.T_AT = all[static_cast<std::size_t>(a.id)];
    out.push_back(a);
  }
  return out;
}

struct Errors {
  double m = 0, rad = 0;
  int known = 0;
};

Errors errors(const Trajectory<M>& in_M, const std::vector<Frame>& frames) {
  Errors e;
  std::size_t k = 0;
  for (const StampedPose<M>& p : in_M) {
    while (frames[k].t != p.t) ++k;
    const Pose<A, B> truth = truth_of(frames[k]);
    e.m += (p.T.p - truth.p).squaredNorm(), e.rad += so3_log(p.T.q.conjugate() * truth.q).squaredNorm(), ++e.known;
  }
  e.m = std::sqrt(e.m / e.known), e.rad = std::sqrt(e.rad / e.known);
  return e;
}

struct Flown {
  int moved = 0, refused = 0, taken = 0, before = 0;
  Errors causal, after;
};

template <class Anchors>
Flown fly(LoopCloser& closer, const std::vector<Frame>& frames, Anchors anchors_of, std::uint32_t reset_counter = 0) {
  Flown out;
  Trajectory<G> in_G;
  Trajectory<M> causal;
  for (const Frame& f : frames) {
    Keyframe k = keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry, reset_counter);
    k.anchors = anchors_of(f);
    const MapUpdate u = closer.process(f.place, k);
    in_G.push_back({f.t, f.odometry});
    out.moved += u.M_moved.has_value(), out.refused += u.stats.anchors_refused, out.taken += u.stats.anchors;
    out.before += !u.anchored;
    if (u.anchored && u.localised) causal.push_back({f.t, u.T_MG * f.odometry});
    EXPECT_LT((u.T_MW_smooth.p - u.T_MW.p).norm(), 1.0) << "no long way to another M";
  }
  closer.finish();
  out.causal = errors(causal, frames), out.after = errors(closer.corrected(in_G), frames);
  return out;
}

TEST(AnchoredMap, PositionsMakeMTheBuildingsFrameAndOutliersChangeNothing) {
  const auto frames = flight(room(1), 250, 0.004, 0.05, 2);
  for (const double outliers : {0.0, 0.2}) {
    Rng rng(5);
    LoopCloser closer(rig(), {}, vocabulary());
    const Flown flown = fly(closer, frames, [&](const Frame& f) {
      Anchor a = position(f, rng, 0.05);
      if (rng.uniform() < outliers) std::get<PositionAnchor>(a).p_A += noise(rng, 2);
      return std::vector{a};
    });
    EXPECT_EQ(flown.moved, 1);
    EXPECT_GT(flown.before, 3);
    EXPECT_LT(flown.before, 60);
    EXPECT_LT(flown.causal.m, 0.06);
    EXPECT_LT(flown.after.m, 0.02);
    EXPECT_LT(flown.after.rad, 0.006);
    if (outliers > 0) EXPECT_GT(flown.refused, 25);
    else EXPECT_LT(flown.refused, 5);
  }
}

TEST(AnchoredMap, ThreeTagsDoSoToACentimetreWithWrongNumbersAsWell) {
  const auto frames = flight(room(1), 300, 0.004, 0.05, 2);
  for (const double wrong : {0.0, 0.2}) {
    Rng rng(6);
    LoopCloser closer(rig(), {}, vocabulary());
    const Flown flown = fly(closer, frames, [&](const Frame& f) { return seen_tags(f, rng, wrong); });
    EXPECT_EQ(flown.moved, 1);
    EXPECT_LT(flown.after.m, 0.01);
    EXPECT_LT(flown.after.rad, 0.0035);
    EXPECT_LT(flown.causal.m, 0.03);
    EXPECT_GT(flown.taken, 50);
  }
}

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

}  // namespace
}  // namespace fbvins
