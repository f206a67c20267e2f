// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/pose.hpp"

#include <gtest/gtest.h>

#include <type_traits>

namespace fbvins {
namespace pose_test {

template <class A, class B2>
concept composable = requires(A a, B2 b) {
  a* b;
};

static_assert(composable<Pose<W, B>, Pose<B, C0>>);
static_assert(!composable<Pose<W, B>, Pose<C0, W>>, "frames that do not meet must not compile");
static_assert(!std::is_convertible_v<Pose<W, B>, Pose<B, W>>);
static_assert(std::is_same_v<decltype(Pose<W, B>{} * Pose<B, C0>{}), Pose<W, C0>>);

TEST(Pose, InverseCancels) {
  const Pose<W, B> T(so3_exp(Vec3(0.1, 0.7, -1.2)), Vec3(1, -2, 3));
  const Pose<W, W> I = T * T.inverse();
  EXPECT_LT(I.p.norm(), 1e-14);
  EXPECT_LT(so3_log(I.q).norm(), 1e-14);
}

TEST(Pose, ProductActsLikeSuccessiveTransforms) {
  const Pose<W, B> T_WB(so3_exp(Vec3(0.1, 0.7, -1.2)), Vec3(1, -2, 3));
  const Pose<B, C0> T_BC(so3_exp(Vec3(-0.5, 0.2, 0.4)), Vec3(0.1, 0, 0.02));
  const Vec3 x(0.3, 0.4, 5);
  EXPECT_LT(((T_WB * T_BC) * x - T_WB * (T_BC * x)).norm(), 1e-14);
}

TEST(Pose, BoxplusIsWorldTranslationAndLocalRotation) {
  const Pose<W, B> T(so3_exp(Vec3(0, 0, 1.0)), Vec3(1, 2, 3));
  const Pose<W, B> moved = T.boxplus(Vec3(0.5, 0, 0), Vec3(0, 0, 0.25));
  EXPECT_LT((moved.p - Vec3(1.5, 2, 3)).norm(), 1e-15);
  EXPECT_LT((so3_log(T.q.conjugate() * moved.q) - Vec3(0, 0, 0.25)).norm(), 1e-15);
}

}  // namespace pose_test
}  // namespace fbvins
