// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment of whole maps: a map that is bent comes out straight, and nothing else happens to it.
#include "fbvins/loop/final_adjustment.hpp"

#include <gtest/gtest.h>

#include "fbvins/loop/adjustment.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace final_adjustment_test {

using namespace test_room;

struct Mapped {
  std::vector<Frame> frames;
  PlaceMap map;
};

/// One and a half rounds, so that loops close; drift as of a poor odometry.
Mapped mapped(std::uint64_t seed) {
  Mapped m{flight(room(1), 140, 0.004, 0.05, seed), {}};
  LoopCloser closer(rig(), {}, vocabulary());
  for (const Frame& f : m.frames) closer.process(f.place, keyframe(FrameId{f.t.ns / 1000}, f.t, f.odometry));
  closer.finish();
  m.map = closer.map();
  return m;
}

/// RMS distance of the keyframes from the truth, the first one taken as the frame.
double error_m(const Mapped& m) {
  const Pose<G, B> T0 = m.frames[0].truth;
  const Pose<B, M> T_B0_M = m.map.keyframes()[0].T_MB.inverse();
  double sum = 0;
  for (std::size_t i = 0; i < m.map.size(); ++i)
    sum += (T0 * (T_B0_M * m.map.keyframes()[i].T_MB).p - m.frames[i].truth.p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(m.map.size()));
}

TEST(FinalAdjustment, MakesTheMapBetterThanTheGraph) {
  for (const std::uint64_t seed : {5, 6, 7}) {
    Mapped m = mapped(seed);
    const double before = error_m(m);
    const FinalAdjustmentReport report = adjust_map(m.map, {});
    EXPECT_LT(error_m(m), 0.7 * before) << seed;
    EXPECT_LT(error_m(m), 0.01) << seed;
    EXPECT_LT(report.final_rms_px, std::sqrt(2) * kPixel) << seed;
    EXPECT_LT(report.final_rms_px, report.initial_rms_px) << seed;
  }
}

TEST(FinalAdjustment, WrongDepthsDoNotBendIt) {
  Mapped m = mapped(5), clean = m;
  Rng rng(9);
  for (MapKeyframe& k : m.map.keyframes())
    for (PlaceFeature& f : k.place.features)
      if (rng.below(20) == 0) f.inverse_depth *= 1.5f;
  adjust_map(clean.map, {});
  adjust_map(m.map, {});
  EXPECT_LT(error_m(m), 1.5 * error_m(clean) + 0.001);
}

TEST(FinalAdjustment, WithNothingThatTiesPosesThereIsNothingToSolve) {
  PlaceMap map;
  for (int i = 0; i < 3; ++i) map.add(MapKeyframe{});
  const Adjustment adjustment(map);
  AdjustmentState x = adjustment.start();
  EXPECT_EQ(adjustment.solve(x), 0);
  EXPECT_EQ(x.poses, adjustment.start().poses);
}

/// The same with the IMU, in a gauge that is not level, which the estimator does not know: it takes M for level.
Mapped mapped_with_readings(std::uint64_t seed, const Quat& q_GL, bool false_readings = false) {
  Mapped m{flight(room(1), 140, 0.004, 0.05, seed), {}};
  const ImuBias bias{{0.01, -0.02, 0.015}, {0.2, -0.1, 0.3}};
  LoopCloser closer(rig(), {}, vocabulary());
  for (std::size_t i = 0; i < m.frames.size(); ++i) {
    Frame& f = m.frames[i];
    const Pose<G, B> T_GB(q_GL * f.odometry.q, q_GL * f.odometry.p);
    Keyframe k = keyframe(FrameId{static_cast<std::int64_t>(i)}, f.t, T_GB);
    k.gauge.v_GB = q_GL * true_velocity(f.t.seconds());
    const Duration late = Duration::from_seconds(false_readings ? 3 : 0);
    if (i > 0) k.imu.segments = {readings(m.frames[i - 1].t + late, f.t + late, bias)};
    for (ImuSegment& segment : k.imu.segments)
      for (ImuSample& sample : segment.samples) sample.t = sample.t + Duration::from_seconds(-late.seconds());
    closer.process(f.place, k);
  }
  closer.finish();
  m.map = closer.map();
  return m;
}

/// Angle between M's z and up, as the truth has it.
double tilt_rad(const Mapped& m) {
  double sum = 0;
  for (std::size_t i = 0; i < m.map.size(); ++i) {
    const Vec3 up_M = m.map.keyframes()[i].T_MB.q * (m.frames[i].truth.q.conjugate() * Vec3::UnitZ());
    sum += std::atan2(up_M.head<2>().norm(), up_M.z());
  }
  return sum / static_cast<double>(m.map.size());
}

TEST(FinalAdjustment, TheReadingsLevelTheMap) {
  for (const std::uint64_t seed : {5, 6}) {
    Mapped m = mapped_with_readings(seed, so3_exp(Vec3(0.04, -0.03, 0)));
    const double before = error_m(m);
    EXPECT_GT(tilt_rad(m), 0.045) << seed;
    const FinalAdjustmentReport report = adjust_map(m.map, {});
    EXPECT_EQ(report.refused, "") << seed;
    EXPECT_LT(error_m(m), 0.6 * before) << seed;
    EXPECT_LT(error_m(m), 0.01) << seed;
    EXPECT_LT(tilt_rad(m), 0.0025) << seed;
    EXPECT_LT(report.after.imu, 2) << seed;
  }
}

TEST(FinalAdjustment, AResultThatFitsNoBetterIsRefusedAndTheMapStays) {
  Mapped m = mapped_with_readings(5, Quat::Identity(), true);  // of another moment of the flight
  const std::string before = serialise_map(m.map);
  const FinalAdjustmentReport report = adjust_map(m.map, {});
  EXPECT_NE(report.refused, "");
  EXPECT_EQ(serialise_map(m.map), before);
}

/// Poses in the building's frame, without a fit.
double error_in_building_m(const Mapped& m, const Pose<A, G>& T_AR) {
  double sum = 0;
  for (std::size_t i = 0; i < m.map.size(); ++i) sum += (m.map.keyframes()[i].T_MB.p - T_AR * m.frames[i].truth.p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(m.map.size()));
}

TEST(FinalAdjustment, KeepsAnAnchoredMapInTheBuilding) {
  const Pose<A, G> T_AR(so3_exp(Vec3(0, 0, 2.1)), Vec3(8, -5, 2));
  for (const bool with_readings : {false, true}) {
    Mapped m = with_readings ? mapped_with_readings(5, Quat::Identity()) : mapped(5);
    Rng rng(4);
    m.map.move(T_AR.cast_frames<M, M>());
    for (std::size_t i = 0; i < m.map.size(); ++i) {
      const Vec3 noise = 0.05 * Vec3(rng.normal(), rng.normal(), rng.normal());
      PositionAnchor a{.p_A = T_AR * m.frames[i].truth.p + noise, .covariance = 0.0025 * Mat3::Identity()};
      if (i % 5 == 0) a.p_A += 30 * noise;
      m.map.add_anchor({m.map.keyframes()[i].id, measurement_of(a)});
    }
    m.map.anchored = true;
    m.map.optimise({});
    const double before = error_in_building_m(m, T_AR);
    const FinalAdjustmentReport report = adjust_map(m.map, {});
    EXPECT_EQ(report.refused, "");
    EXPECT_EQ(report.tilt_rad, 0);
    EXPECT_LT(error_in_building_m(m, T_AR), before);
    EXPECT_LT(error_in_building_m(m, T_AR), 0.012);
  }
}

TEST(FinalAdjustment, SameBitsAndNothingToDo) {
  Mapped a = mapped(5), b = a;
  adjust_map(a.map, {});
  adjust_map(b.map, {});
  EXPECT_EQ(serialise_map(a.map), serialise_map(b.map));
  PlaceMap nothing;
  EXPECT_EQ(adjust_map(nothing, {}).points, 0);
  PlaceMap alone;
  alone.cameras[0] = rig().T_BC0();
  alone.add(a.map.keyframes()[0]);
  const PlaceMap before = alone;
  EXPECT_EQ(adjust_map(alone, {}).points, 0);
  EXPECT_EQ(serialise_map(alone), serialise_map(before));
}

}  // namespace final_adjustment_test
}  // namespace fbvins
