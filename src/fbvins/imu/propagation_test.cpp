// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/propagation.hpp"

#include <gtest/gtest.h>

#include "tests/support/integrated_test_motion.hpp"

namespace fbvins {
namespace propagation_test {

using test::integrated;
using test::kBias;
using test::kFrom;
using test::kTo;
using test::Motion;

TEST(Propagation, AgreesWithPreintegration) {
  const Motion motion;
  const ImuSegment segment = motion.segment(kFrom, kTo, Duration{5'000'000}, kBias);
  const NavState<W> i = motion.state(kFrom.seconds(), kBias);
  const NavState<W> a = integrated(segment, kBias).predict(i, level_gravity()), b = propagate(i, segment, level_gravity());
  EXPECT_LT(a.boxminus(b).norm(), 1e-12);
  EXPECT_LT(so3_log(integrate_gyro(segment, kBias.gyro_radps).conjugate() * integrated(segment, kBias).delta_q()).norm(), 1e-13);
}

TEST(Propagation, FollowsAnExactMotion) {
  const Motion motion;
  const NavState<W> to =
      propagate(motion.state(kFrom.seconds(), kBias), motion.segment(kFrom, kTo, Duration{5'000'000}, kBias), level_gravity());
  const Vec15 error = to.boxminus(motion.state(kTo.seconds(), kBias));
  EXPECT_LT(error.segment<3>(nav::p).norm(), 5e-5);
  EXPECT_LT(error.segment<3>(nav::theta).norm(), 3e-5);
  EXPECT_LT(error.segment<3>(nav::v).norm(), 2e-4);
  EXPECT_EQ(error.tail<6>().norm(), 0);
}

TEST(Propagation, WithoutReadingsNothingMoves) {
  const NavState<W> s = Motion().state(1.0, kBias);
  EXPECT_EQ(propagate(s, {}, level_gravity()).boxminus(s), Vec15::Zero());
  EXPECT_EQ(integrate_gyro({}, kBias.gyro_radps).angularDistance(Quat::Identity()), 0);
}

}  // namespace propagation_test
}  // namespace fbvins
