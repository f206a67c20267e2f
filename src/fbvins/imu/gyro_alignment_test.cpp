// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/gyro_alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "tests/support/carried_by_hand.hpp"

namespace fbvins {
namespace gyro_alignment_test {

using namespace carried_by_hand;

std::optional<GyroAlignmentEstimate> found(Hand hand, double seconds) {
  GyroAlignment alignment(Mat3::Identity(), kMiddle_px, 0, {});
  for (const TrackedFrame& frame : hand.frames(seconds)) alignment.add(frame, {});
  return alignment.solve();
}

TEST(GyroAlignment, FindsOffsetsInBothDirectionsWithinASecondAndAHalf) {
  for (const double late_s : {-0.08, -0.02, 0.0, 0.05, 0.07}) {
    Hand hand;
    hand.late_s = late_s;
    const auto estimate = found(hand, 1.5);
    ASSERT_TRUE(estimate);
    EXPECT_NEAR(estimate->time_offset_s(), -late_s, 0.002) << late_s;
    EXPECT_LT(std::abs(estimate->time_offset_s() + late_s), 3 * estimate->time_offset_sigma_s());
    EXPECT_LT((estimate->gyro_bias_radps() - kBias).norm(), 0.04);
  }
}

/// The direction of so small a translation is not known.
TEST(GyroAlignment, AHoverMakesNoOffset) {
  for (int seed = 1; seed <= 5; ++seed) {
    Hand hover;
    hover.rng = Rng(seed);
    hover.moves = 0.05, hover.rate_radps = 0.3;
    const auto estimate = found(hover, 5);
    ASSERT_TRUE(estimate);
    EXPECT_LT(std::abs(estimate->time_offset_s()), 2.5 * estimate->time_offset_sigma_s()) << seed;
    EXPECT_LT(estimate->time_offset_sigma_s(), 0.004);
    EXPECT_LT((estimate->gyro_bias_radps() - kBias).norm(), 0.01);
  }
}

TEST(GyroAlignment, FindsTheLineDelayBeside) {
  Hand hand;
  hand.late_s = 0.03, hand.line_delay_s = 60e-6;
  const auto estimate = found(hand, 5);
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->time_offset_s(), -0.03, 0.001);
  EXPECT_NEAR(estimate->line_delay_s(), 60e-6, 6e-6);
  EXPECT_LT(std::abs(estimate->line_delay_s() - 60e-6), 3 * estimate->line_delay_sigma_s());
}

TEST(GyroAlignment, StampsWithNoiseOfTheirOwnAreSaid) {
  double mean_s = 0;
  for (int seed = 1; seed <= 6; ++seed) {
    Hand exact, jittered;
    exact.rng = jittered.rng = Rng(seed);
    jittered.jitter_s = 0.005;  // uniform: a standard deviation of 2.9 ms
    EXPECT_LT(found(exact, 5)->stamp_sigma_s, 0.0004) << seed;
    mean_s += found(jittered, 5)->stamp_sigma_s / 6;
  }
  EXPECT_NEAR(mean_s, 0.0021, 0.0008) << "it says what is certain";
}

TEST(GyroAlignment, WithoutMotionNothingIsKnown) {
  Hand still;
  still.rate_radps = 0;
  const auto estimate = found(still, 2);
  ASSERT_TRUE(estimate);
  EXPECT_GT(estimate->time_offset_sigma_s(), 0.02);
}

TEST(GyroAlignment, SolvedOftenItIsAsSolvedOnce) {
  Hand hand;
  hand.late_s = 0.03, hand.line_delay_s = 40e-6;
  GyroAlignment often(Mat3::Identity(), kMiddle_px, 0, {});
  std::optional<GyroAlignmentEstimate> last;
  for (const TrackedFrame& frame : hand.frames(5)) {
    often.add(frame, {});
    last = often.solve();
  }
  Hand same;
  same.late_s = 0.03, same.line_delay_s = 40e-6;
  const auto once = found(same, 5);
  ASSERT_TRUE(once && last);
  EXPECT_LT(std::abs(once->time_offset_s() - last->time_offset_s()), 0.2 * once->time_offset_sigma_s());
  EXPECT_LT(std::abs(once->line_delay_s() - last->line_delay_s()), 0.2 * once->line_delay_sigma_s());
  EXPECT_NEAR(once->time_offset_sigma_s(), last->time_offset_sigma_s(), 0.05 * once->time_offset_sigma_s());
}

/// A train passes before the window: its pairs fit no turn.
TEST(GyroAlignment, PairsThatDoNotFitCountForLittle) {
  GyroAlignment alignment(Mat3::Identity(), kMiddle_px, 0, {});
  Hand hand;
  hand.late_s = 0.03;
  Rng rng(3);
  for (TrackedFrame& frame : hand.frames(6)) {
    const double t = (frame.t - Time{}).seconds() - 10;
    if (t > 2 && t < 4)
      for (TrackedFeature& f : frame.features)
        f.by(0)->normalised += Vec2(0.3 * (t - 2), 0) + 0.01 * Vec2(rng.normal(), rng.normal());
    alignment.add(frame, {});
  }
  const auto estimate = alignment.solve();
  ASSERT_TRUE(estimate);
  EXPECT_LT(std::abs(estimate->time_offset_s() + 0.03), 3 * estimate->time_offset_sigma_s());
  EXPECT_NEAR(estimate->time_offset_s(), -0.03, 0.002);
}

/// Nothing was said of the readings that were lost, and nothing is forgotten.
TEST(GyroAlignment, AGapTakesNothingButItsPairs) {
  Hand hand;
  hand.late_s = 0.03;
  std::vector<TrackedFrame> frames = hand.frames(4);
  GyroAlignment whole(Mat3::Identity(), kMiddle_px, 0, {}), gap(Mat3::Identity(), kMiddle_px, 0, {});
  for (std::size_t i = 0; i < frames.size(); ++i) {
    whole.add(frames[i], {});
    if (i >= 40 && i < 45) frames[i].imu = {};
    gap.add(frames[i], {});
  }
  EXPECT_LT(gap.pairs(), whole.pairs() - 4);
  EXPECT_GT(gap.pairs(), whole.pairs() - 20);
  const auto estimate = gap.solve();
  EXPECT_LT(std::abs(estimate->time_offset_s() + 0.03), 3 * estimate->time_offset_sigma_s());
}

TEST(GyroAlignment, NoPairNoEstimate) {
  GyroAlignment alignment(Mat3::Identity(), kMiddle_px, 0, {});
  EXPECT_FALSE(alignment.solve());
  alignment.add(TrackedFrame{}, {});
  EXPECT_FALSE(alignment.solve());
}

}  // namespace gyro_alignment_test
}  // namespace fbvins
