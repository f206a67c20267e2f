// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment of whole maps: a map that is bent comes out straight, and nothing else happens to it.
#include "fbvins/loop/final_adjustment.hpp"

#include <gtest/gtest.h>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/test_room.hpp"

namespace fbvins {
namespace {

using namespace test_room;

struct Mapped {
  std::vector<Frame> frames;
  PlaceMap map;
};

/// One and a half rounds, so that loops close; drift as of a poor odometry.
Mapped mapped(std::uint64_t seed) {
  Mapped m{flight(room(1), 140, 0.004, 0.05, seed), {}};
  LoopCloser closer(rig(), {}, vocabulary());
  for (const Frame& f : m.frames) closer.process(f.place, FrameId{f.t.ns / 1000}, f.t, f.odometry, 0);
  closer.finish();
  m.map = closer.map();
  return m;
}

/// RMS distance of the keyframes from the truth, the first one taken as the frame.
double error_m(const Mapped& m) {
  const Pose<W, B> T0 = m.frames[0].truth;
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

TEST(FinalAdjustment, SameBitsAndNothingToDo) {
  Mapped a = mapped(5), b = a;
  adjust_map(a.map, {});
  adjust_map(b.map, {});
  EXPECT_EQ(serialise_map(a.map), serialise_map(b.map));
  PlaceMap nothing;
  EXPECT_EQ(adjust_map(nothing, {}).points, 0);
  PlaceMap alone;
  alone.T_BC0 = rig().T_BC0;
  alone.add(a.map.keyframes()[0]);
  const PlaceMap before = alone;
  EXPECT_EQ(adjust_map(alone, {}).points, 0);
  EXPECT_EQ(serialise_map(alone), serialise_map(before));
}

}  // namespace
}  // namespace fbvins
