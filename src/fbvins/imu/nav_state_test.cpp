// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/nav_state.hpp"

#include <gtest/gtest.h>

#include <type_traits>

#include "tests/support/imu_test_motion.hpp"

namespace fbvins {
namespace nav_state_test {

using test::Motion;
const ImuBias kBias{Vec3(0.02, -0.03, 0.05), Vec3(0.1, -0.2, 0.15)};

// A pose of the window is none that is published: only the levelling takes one to the other.
static_assert(!std::is_convertible_v<Pose<G, B>, Pose<W, B>>);
static_assert(!std::is_convertible_v<NavState<G>, NavState<W>>);

TEST(NavState, BoxminusUndoesBoxplus) {
  const NavState<W> s = Motion().state(1.0, kBias);
  Vec15 d;
  for (int k = 0; k < 15; ++k) d(k) = 0.1 * (k - 7);
  EXPECT_LT((s.boxplus(d).boxminus(s) - d).norm(), 1e-13);
}

TEST(NavState, PerturbationsAreLocalInRotationAndInTheWorldElsewhere) {
  const NavState<W> s = Motion().state(1.0, kBias);
  Vec15 d = Vec15::Zero();
  d.segment<3>(nav::p) = Vec3(1, 2, 3);
  d.segment<3>(nav::theta) = Vec3(0.1, 0, 0);
  d.segment<3>(nav::v) = Vec3(0, 0, -1);
  const NavState<W> moved = s.boxplus(d);
  EXPECT_LT((moved.T_FB.p - s.T_FB.p - Vec3(1, 2, 3)).norm(), 1e-14);
  EXPECT_LT(so3_log((s.T_FB.q * so3_exp(Vec3(0.1, 0, 0))).conjugate() * moved.T_FB.q).norm(), 1e-14);
  EXPECT_LT((moved.v_FB - s.v_FB - Vec3(0, 0, -1)).norm(), 1e-14);
  EXPECT_EQ(moved.bias.gyro_radps, s.bias.gyro_radps);
}

}  // namespace nav_state_test
}  // namespace fbvins
