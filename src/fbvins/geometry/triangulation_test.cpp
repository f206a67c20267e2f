// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/triangulation.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace triangulation_test {

TEST(Triangulation, FindsTheDepthOfRandomPointsFromRandomPairsOfViews) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const Quat R = so3_exp(0.2 * Vec3(rng.normal(), rng.normal(), rng.normal()));
    const Vec3 t = 0.2 * Vec3(rng.normal(), rng.normal(), rng.normal());
    const Vec3 ray(rng.uniform(-0.7, 0.7), rng.uniform(-0.5, 0.5), 1);
    const double rho = 1 / rng.uniform(1, 20);
    const Vec3 far = R * ray, seen = (far + rho * t) / (far + rho * t).z();
    ASSERT_TRUE(inverse_depth_along(far, t, seen));
    EXPECT_NEAR(*inverse_depth_along(far, t, seen), rho, 1e-9);
    ASSERT_TRUE(distance_from_epipolar_line(far, t, seen));
    EXPECT_NEAR(*distance_from_epipolar_line(far, t, seen), 0, 1e-12);
  }
}

TEST(Triangulation, NoiseMovesTheDepthByTheDisparityItMakes) {
  const Vec3 far(0.1, 0.2, 1), t(-0.11, 0, 0), seen = far + 0.5 * t + Vec3(0, 0.003, 0);
  EXPECT_NEAR(*inverse_depth_along(far, t, seen), 0.5, 0.01);
  EXPECT_NEAR(*distance_from_epipolar_line(far, t, seen), 0.003, 1e-12) << "a level baseline: the line is level";
  EXPECT_NEAR(*inverse_depth_along(far, t, far + 0.6 * t), 0.6, 1e-12);
}

TEST(Triangulation, APointAtInfinityHasNoInverseDepthAndBeyondItHasANegativeOne) {
  const Vec3 far(-0.3, 0.1, 1), t(-0.11, 0.01, 0.02);
  EXPECT_NEAR(*inverse_depth_along(far, t, far), 0, 1e-12);
  EXPECT_LT(*inverse_depth_along(far, t, far - 0.1 * t), 0);
}

TEST(Triangulation, NothingIsKnownWithoutABaselineOrAlongIt) {
  const Vec3 far(0.1, -0.2, 1);
  EXPECT_FALSE(inverse_depth_along(far, Vec3::Zero(), far));
  EXPECT_FALSE(distance_from_epipolar_line(far, Vec3::Zero(), far));
  const Vec3 ahead(0, 0, 1);
  EXPECT_FALSE(inverse_depth_along(ahead, 0.5 * ahead, ahead));
  EXPECT_FALSE(distance_from_epipolar_line(ahead, 0.5 * ahead, ahead));
}

}  // namespace triangulation_test
}  // namespace fbvins
