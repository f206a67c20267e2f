// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/floor_scale.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "fbvins/estimator/factor_test.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace floor_scale_test {

constexpr double kHeight_m = 1.4;
const Vec3 kBody(2, 3, 0.5);

/// Landmarks of a floor by images whose scale is wrong by a factor, and of things that stand on it.
std::vector<Vec3> landmarks(double scale, int on_floor, int above, std::uint64_t seed = 4) {
  Rng rng(seed);
  std::vector<Vec3> out;
  for (int k = 0; k < on_floor + above; ++k) {
    const double height = k < on_floor ? 0.005 * rng.normal() : rng.uniform(0.02, 2);
    const Vec3 away(rng.uniform(-3, 3), rng.uniform(-3, 3), height - kHeight_m);
    out.push_back(kBody + scale * away);
  }
  return out;
}

TEST(FloorScale, IsFoundAmongThingsThatStandOnTheFloor) {
  for (const double scale : {0.9, 1.0, 1.1}) {
    const auto found = floor_scale(landmarks(scale, 30, 60), kBody, Vec3::UnitZ(), kHeight_m);
    ASSERT_TRUE(found) << scale;
    EXPECT_NEAR(found->ratio, scale, 0.01 * scale);
  }
}

TEST(FloorScale, IsNoneWithoutEnoughLandmarksOrAFloorAmongThem) {
  EXPECT_FALSE(floor_scale(landmarks(1, 11, 0), kBody, Vec3::UnitZ(), kHeight_m));
  EXPECT_FALSE(floor_scale(landmarks(1.5, 40, 0), kBody, Vec3::UnitZ(), kHeight_m)) << "no start has such a scale";
  std::vector<Vec3> slope;
  for (int k = 0; k < 60; ++k) slope.push_back(kBody - Vec3(0.1 * k - 3, 0, kHeight_m * (0.85 + 0.005 * k)));
  EXPECT_FALSE(floor_scale(slope, kBody, Vec3::UnitZ(), kHeight_m));
}

TEST(DistanceFactor, IsSound) {
  const WindowProblem p = test::make_window(false).problem;
  const double d = (p.frames[4].state.T_FB.p - p.frames[1].state.T_FB.p).norm();
  for (const double times : {1.0, 1.02, 1.5}) test::expect_sound(DistanceFactor(FrameId{1}, FrameId{4}, times * d, 0.03 * d), p);
}

}  // namespace floor_scale_test
}  // namespace fbvins
