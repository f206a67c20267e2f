// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/time_alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/carried_by_hand.hpp"

namespace fbvins {
namespace time_alignment_test {

using namespace carried_by_hand;

TEST(TimeAlignment, AKnownOffsetIsLeftAsItIsAndAWrongOneIsCorrected) {
  for (const double late_s : {0.0, 0.04}) {
    TimeAlignment alignment(StereoRig{}, true, {});
    Hand hand;
    hand.middle_px = 0;  // as in a rig without sizes
    hand.late_s = late_s;
    for (const TrackedFrame& frame : hand.frames(2)) alignment.add(frame, false);
    EXPECT_NEAR(alignment.correction().seconds(), -late_s, 0.002);
  }
}

TEST(TimeAlignment, InFlightItIsCorrectedInSteps) {
  TimeAlignment alignment(StereoRig{}, true, {});
  Hand hand;
  hand.late_s = 0.04, hand.middle_px = 0;
  Duration before{};
  for (const TrackedFrame& frame : hand.frames(4)) {
    alignment.add(frame, true);
    EXPECT_LE(std::abs((alignment.correction() - before).seconds()), 0.0041);
    before = alignment.correction();
  }
  EXPECT_NEAR(before.seconds(), -0.04, 0.002);
}

TEST(TimeAlignment, ThatOfTheFlightBeforeIsAppliedAtOnceAndCorrectedWhereItIsNotAnyMore) {
  for (const double late_s : {0.05, 0.02}) {
    TimeAlignment alignment(StereoRig{}, true, TimeOffsetEstimate{-0.05, 0.001});
    EXPECT_NEAR(alignment.correction().seconds(), -0.05, 1e-9);
    EXPECT_NEAR(alignment.sigma_s(), 0.005, 0.0005) << "nothing was seen yet, and a driver may have changed it a little";
    Hand hand;
    hand.late_s = late_s, hand.middle_px = 0;
    for (const TrackedFrame& frame : hand.frames(1.5)) alignment.add(frame, false);
    EXPECT_NEAR(alignment.correction().seconds(), -late_s, 0.003) << late_s;
    EXPECT_GT(alignment.sigma_s(), 0);
    EXPECT_LT(alignment.sigma_s(), 0.002);
  }
  // No calibration has this one, so that it is no correction of the rig's.
  EXPECT_EQ(TimeAlignment(StereoRig{}, true, TimeOffsetEstimate{-0.5, 0.001}).correction(), Duration{});
  const TimeAlignment off(StereoRig{}, false, TimeOffsetEstimate{-0.05, 0.001});
  EXPECT_EQ(off.correction(), Duration{});
}

TEST(TimeAlignment, ABiasThatTheTracksDoNotShowIsManyStandardDeviationsOff) {
  const Mat3 of_start = 0.003 * 0.003 * Mat3::Identity();
  TimeAlignment alignment(StereoRig{}, true, {});
  EXPECT_EQ(alignment.off_sigmas(Vec3(9, 9, 9), of_start), 0) << "nothing was seen yet";
  Hand hand;
  hand.middle_px = 0;
  for (const TrackedFrame& frame : hand.frames(3)) alignment.add(frame, false);
  EXPECT_LT(alignment.off_sigmas(kBias, of_start), 2);
  EXPECT_GT(alignment.off_sigmas(kBias + Vec3(0.1, 0, 0), of_start), 4);
}

}  // namespace time_alignment_test
}  // namespace fbvins
