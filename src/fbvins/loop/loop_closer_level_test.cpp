// SPDX-License-Identifier: Apache-2.0
// Where up is in a map: flights whose gauge leans, and how well each knows it, in a new map and in an older one.
#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/angle.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_edges.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace loop_closer_level_test {

using namespace test_room;

/// The map of a flight in a level gauge, without drift.
PlaceMap mapped(int keyframes) {
  LoopCloser closer(rig(), {}, vocabulary());
  for (const Frame& f : flight(room(1), keyframes, 0, 0, 2))
    closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry));
  closer.finish();
  return closer.map();
}

TEST(LoopCloserLevel, BetterKnownGravityTurnsTheWholeMapAndBendsNothing) {
  const auto frames = flight(room(1), 200, 0.004, 0.05, 3);
  const Quat q_GL = so3_exp(Vec3(0.04, -0.03, 0));
  LoopCloser level(rig(), {}, vocabulary()), tilted(rig(), {}, vocabulary());
  Trajectory<G> in_G;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& f = frames[i];
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, f.t, f.odometry);
    level.process(f.place, k);
    // The same flight in a gauge that is not level; its tilt becomes known over the first 60 keyframes.
    k.gauge.T_GB = {q_GL * f.odometry.q, q_GL * f.odometry.p};
    k.gauge.q_LG = so3_exp(std::min(1.0, static_cast<double>(i) / 60) * so3_log(q_GL.conjugate()));
    const MapUpdate u = tilted.process(f.place, k);
    EXPECT_LT((u.T_MW * k.gauge.T_GB.p - u.T_MG * k.gauge.T_GB.p).norm(), 1e-12) << "W is the gauge here";
    in_G.push_back({f.t, k.gauge.T_GB});
  }
  level.finish(), tilted.finish();
  const Trajectory<M> in_M = tilted.corrected(in_G);
  const auto &a = level.map().keyframes(), &b = tilted.map().keyframes();
  ASSERT_EQ(a.size(), b.size());
  const Quat turned = a[0].T_MB.q * b[0].T_MB.q.conjugate();
  EXPECT_LT((turned * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-9) << "M is level";
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (turned * (b[i].T_MB.p - b[0].T_MB.p) - (a[i].T_MB.p - a[0].T_MB.p)).squaredNorm();
    EXPECT_LT((b[i].T_MB.p - in_M[i].T.p).norm(), 1e-9);
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(a.size())), 0.003);
}

/// A keyframe of a gauge that leans by 0.05 rad, of which `known` (0 to 1) is known, as well as the estimator says.
Keyframe leaning(FrameId id, const Frame& f, double known, std::uint32_t reset_counter = 0) {
  const Quat q_GL = so3_exp(Vec3(0.04, -0.03, 0));
  Keyframe k = keyframe(id, f.t, {q_GL * f.odometry.q, q_GL * f.odometry.p}, reset_counter);
  k.gauge.q_LG = so3_exp(known * so3_log(q_GL.conjugate()));
  k.gauge.up_sigma_rad = 0.02 * (1 - known) + 0.0015;
  return k;
}

TEST(LoopCloserLevel, ANewMapStaysWhereItIsUntilItLeansForCertainAndSaysHowItMoved) {
  const auto frames = flight(room(1), 80, 0, 0, 3);
  LoopCloser closer(rig(), {}, vocabulary());
  int moves = 0;
  Trajectory<M> in_M;
  Pose<M, W> smooth;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Keyframe k = leaning(FrameId{static_cast<std::int64_t>(i)}, frames[i], std::min(1.0, static_cast<double>(i) / 60));
    const MapUpdate u = closer.process(frames[i].place, k);
    if (u.M_moved) {
      ++moves;
      for (StampedPose<M>& p : in_M) p.T = *u.M_moved * p.T;
    }
    in_M.push_back({k.t, u.T_MG * k.gauge.T_GB});
    const Vec3 body_W = k.T_WG * k.gauge.T_GB.p;
    const Vec3 step = u.T_MW_smooth * body_W - (i > 0 ? smooth : u.T_MW_smooth) * body_W;
    EXPECT_LT(step.norm(), 0.0301) << "0.15 m/s for 0.2 s, also where M moves";
    smooth = u.T_MW_smooth;
    const double leans = angle_between(u.T_MG.q * k.gauge.q_LG.conjugate(), about_z(yaw_of(u.T_MG.q)));
    EXPECT_LT(leans, std::max(0.25 * kDegree, 3 * k.gauge.up_sigma_rad) + 1e-4) << i;
  }
  EXPECT_EQ(moves, 3);
  const Pose<M, G> T = in_M.back().T * frames.back().truth.inverse();
  for (std::size_t i = 0; i < frames.size(); ++i)
    EXPECT_LT((T * frames[i].truth.p - in_M[i].T.p).norm(), 0.015) << "a tilt of 0.05 rad would be 0.1 m";
  closer.finish();
  const Pose<M, B>& first = closer.map().keyframes()[0].T_MB;
  EXPECT_LT((first.q * frames[0].truth.q.conjugate() * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-4) << "level in the end";
}

TEST(LoopCloserLevel, ARestartLeavesANewMapAsLevelAsIsKnown) {
  const auto frames = flight(room(1), 22, 0, 0, 3);
  LoopCloser closer(rig(), {}, vocabulary());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool again = i == 21;
    const Keyframe k =
        leaning(FrameId{static_cast<std::int64_t>(i)}, frames[i], again ? 0.0 : static_cast<double>(i) / 60, again);
    EXPECT_EQ(closer.process(frames[i].place, k).M_moved.has_value(), again) << i;
  }
  const Quat q_ML = closer.map().keyframes()[0].T_MB.q * frames[0].truth.q.conjugate();
  EXPECT_NEAR(angle_between(q_ML, about_z(yaw_of(q_ML))), 0.05 * (1 - 20.0 / 60), 1e-4);
}

TEST(LoopCloserLevel, ALaterFlightsGaugeIsItsOwn) {
  const PlaceMap first = mapped(250);
  LoopCloser again(rig(), {}, vocabulary(), first);
  const Quat q_GL = so3_exp(Vec3(-0.03, 0.03, 0)) * about_z(2.0);
  const auto frames = flight(room(1), 100, 0.001, 0.01, 9, 7.3);
  double worst_m = 0;
  int localised = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& f = frames[i];
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, f.t, {q_GL * f.odometry.q, q_GL * f.odometry.p});
    if (i > 40) k.gauge.q_LG = so3_between(q_GL * Vec3::UnitZ(), Vec3::UnitZ());
    const MapUpdate u = again.process(f.place, k);
    if (!u.localised) continue;
    ++localised;
    if (i > 50) worst_m = std::max(worst_m, ((u.T_MG * k.gauge.T_GB).p - f.truth.p).norm());
  }
  EXPECT_GT(localised, 60);
  EXPECT_LT(worst_m, 0.05);
  const Vec3 first_before = first.keyframes()[0].T_MB.p;
  again.finish();
  EXPECT_LT((again.map().keyframes()[0].T_MB.p - first_before).norm(), 0.003) << "the old map's frame stays";
}

TEST(LoopCloserLevel, AnOlderMapSaysWhereUpIsAndIsNotMovedByAFlightThatDoesNotKnow) {
  const PlaceMap first = mapped(120);
  LoopCloser again(rig(), {}, vocabulary(), first);
  const auto frames = flight(room(1), 60, 0.002, 0.02, 9, 7.3);
  double worst_m = 0, worst_rad = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Keyframe k = leaning(FrameId{static_cast<std::int64_t>(i)}, frames[i], 0);  // by 2.9 degrees, to the end
    const MapUpdate u = again.process(frames[i].place, k);
    if (i < 10) continue;
    ASSERT_TRUE(u.localised);
    const Pose<M, B> T_MB = u.T_MG * k.gauge.T_GB;
    worst_m = std::max(worst_m, (T_MB.p - frames[i].truth.p).norm());
    const Vec3 up = T_MB.q.conjugate() * Vec3::UnitZ(), true_up = frames[i].truth.q.conjugate() * Vec3::UnitZ();
    worst_rad = std::max(worst_rad, (up - true_up).norm());
  }
  EXPECT_LT(worst_m, 0.02);
  EXPECT_LT(worst_rad, 0.3 * kDegree);
  again.finish();
  int kept = 0;
  for (const MapKeyframe& k : first.keyframes()) {
    const MapKeyframe* now = again.map().find(k.id);
    if (now == nullptr) continue;
    ++kept;
    EXPECT_LT((now->T_MB.p - k.T_MB.p).norm(), 0.006) << k.id.value;
  }
  EXPECT_GT(kept, 40);
}

}  // namespace loop_closer_level_test
}  // namespace fbvins
