// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/five_point.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace five_point_test {

struct Five {
  std::array<Vec2, 5> a, b;
};

/// Five points 2-8 m before the first camera, seen from both.
Five five_matches(const Mat3& R_ba, const Vec3& t_ba, Rng& rng) {
  Five s;
  for (std::size_t n = 0; n < 5;) {
    const Vec3 p_a = rng.uniform(2.0, 8.0) * Vec3(rng.uniform(-0.7, 0.7), rng.uniform(-0.45, 0.45), 1.0);
    const Vec3 p_b = R_ba * p_a + t_ba;
    if (p_b.z() < 0.5) continue;
    s.a[n] = p_a.hnormalized();
    s.b[n++] = p_b.hnormalized();
  }
  return s;
}

/// Distance of the nearest solution to E, whatever its sign.
double nearest(const std::vector<Mat3>& solutions, const Mat3& E) {
  const Mat3 truth = E.normalized();
  double best = 1e9;
  for (const Mat3& s : solutions) best = std::min({best, (s.normalized() - truth).norm(), (s.normalized() + truth).norm()});
  return best;
}

TEST(FivePoint, TheTrueEssentialMatrixIsAmongTheSolutions) {
  Rng rng(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Mat3 R = so3_exp(Vec3(rng.normal(), rng.normal(), rng.normal()) * 0.2).toRotationMatrix();
    const Vec3 t = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
    const Five s = five_matches(R, t, rng);
    EXPECT_LT(nearest(five_point(s.a, s.b), hat(t) * R), 1e-6) << "trial " << trial;
  }
}

TEST(FivePoint, EverySolutionIsEssentialAndFitsTheFive) {
  Rng rng(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Mat3 R = so3_exp(Vec3(0.1, -0.2, 0.05)).toRotationMatrix();
    const Five s = five_matches(R, Vec3(0.3, 0.1, -0.2), rng);
    for (const Mat3& E : five_point(s.a, s.b)) {
      for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(s.b[i].homogeneous().dot(E * s.a[i].homogeneous()), 0, 1e-9);
      EXPECT_NEAR(E.norm(), 1, 1e-12);
      EXPECT_NEAR(E.determinant(), 0, 1e-6);
      EXPECT_LT((2 * E * E.transpose() * E - (E * E.transpose()).trace() * E).norm(), 1e-6);
    }
  }
}

TEST(FivePoint, DegenerateMatchesGiveNothingThatIsNotFinite) {
  Rng rng(5);
  const Five s = five_matches(Mat3::Identity(), Vec3::Zero(), rng);
  for (const Mat3& E : five_point(s.a, s.b)) EXPECT_TRUE(E.allFinite());
  const std::array<Vec2, 5> one_point{Vec2(0.1, 0.2), Vec2(0.1, 0.2), Vec2(0.1, 0.2), Vec2(0.1, 0.2), Vec2(0.1, 0.2)};
  for (const Mat3& E : five_point(one_point, one_point)) EXPECT_TRUE(E.allFinite());
}

TEST(FivePoint, DecompositionRebuildsTheMatrix) {
  Rng rng(6);
  for (int trial = 0; trial < 50; ++trial) {
    const Mat3 R_ba = so3_exp(0.3 * Vec3(rng.normal(), rng.normal(), rng.normal())).toRotationMatrix();
    const Vec3 t_ba = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
    const Mat3 E = hat(t_ba) * R_ba;
    const auto [R, t] = decompose_essential(E);
    EXPECT_NEAR(R.determinant(), 1, 1e-12);
    EXPECT_GT(std::abs(t.dot(t_ba)), 1 - 1e-12);
    EXPECT_LT(nearest({hat(t) * R}, E), 1e-9);
  }
}

TEST(FivePoint, DecompositionChoosesTheSmallerRotation) {
  const Mat3 R_ba = so3_exp(Vec3(0.03, -0.05, 0.08)).toRotationMatrix();
  const Vec3 t_ba(0.25, -0.05, 0.1);
  EXPECT_LT((decompose_essential(hat(t_ba) * R_ba).R_ba - R_ba).norm(), 1e-8);
  EXPECT_LT((decompose_essential(-hat(t_ba) * R_ba).R_ba - R_ba).norm(), 1e-8);
}

}  // namespace five_point_test
}  // namespace fbvins
