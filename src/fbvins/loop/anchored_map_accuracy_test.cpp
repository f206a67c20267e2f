// SPDX-License-Identifier: Apache-2.0
// How well anchors put a map into the building's frame, over whole flights with and without outliers.
#include <gtest/gtest.h>

#include "tests/support/anchored_flight.hpp"

namespace fbvins {
namespace anchored_map_accuracy_test {

using namespace test_room;

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

}  // namespace anchored_map_accuracy_test
}  // namespace fbvins
