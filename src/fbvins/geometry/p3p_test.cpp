// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/p3p.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace p3p_test {

struct Triple {
  std::array<Vec3, 3> rays, points;
};

/// Three points 1-8 m before a camera with p_C = q * point + t.
Triple triple(const Quat& q, const Vec3& t, Rng& rng) {
  Triple s;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 p_C = rng.uniform(1, 8) * Vec3(rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6), 1);
    s.rays[k] = p_C;
    s.points[k] = q.conjugate() * (p_C - t);
  }
  return s;
}

/// Distance of the nearest solution to the truth.
double nearest(const P3pSolutions& solutions, const Quat& q, const Vec3& t) {
  double best = 1e9;
  for (const auto& [R, p] : solutions) best = std::min(best, (R - q.toRotationMatrix()).norm() + (p - t).norm());
  return best;
}

TEST(P3p, FindsTheTruePoseAmongItsSolutionsOfRandomTriples) {
  Rng rng(3);
  int found = 0;
  constexpr int kTries = 500;
  for (int i = 0; i < kTries; ++i) {
    const Quat q = so3_exp(Vec3(rng.normal(), rng.normal(), rng.normal()));
    const Vec3 t(rng.normal(), rng.normal(), rng.normal());
    const Triple s = triple(q, t, rng);
    const P3pSolutions solutions = solve_p3p(s.rays, s.points);
    for (const auto& [R, p] : solutions) EXPECT_NEAR(R.determinant(), 1.0, 1e-9);
    found += nearest(solutions, q, t) < 1e-5;
  }
  EXPECT_GE(found, kTries - 5);  // a handful of triples is close to degenerate
}

TEST(P3p, EverySolutionSeesThePointsWhereTheRaysSay) {
  Rng rng(8);
  for (int i = 0; i < 100; ++i) {
    const Triple s = triple(so3_exp(Vec3(0.2, -0.4, 0.1)), Vec3(0.3, -0.2, 0.5), rng);
    for (const auto& [R, t] : solve_p3p(s.rays, s.points))
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LT((R * s.points[k] + t).normalized().cross(s.rays[k].normalized()).norm(), 1e-4);
  }
}

TEST(P3p, AKnownPose) {
  const Quat q = so3_exp(Vec3(0, 0, 0.5));
  const Vec3 t(0.1, -0.2, 4);
  const std::array<Vec3, 3> points{Vec3(1, 0, 0), Vec3(0, 1, 0.5), Vec3(-1, -0.5, 1)};
  std::array<Vec3, 3> rays;
  for (std::size_t k = 0; k < 3; ++k) rays[k] = q * points[k] + t;
  EXPECT_LT(nearest(solve_p3p(rays, points), q, t), 1e-9);
  for (Vec3& ray : rays) ray *= 7;  // the length of a ray says nothing
  EXPECT_LT(nearest(solve_p3p(rays, points), q, t), 1e-9);
}

TEST(P3p, PointsOnALineOrOnOneAnotherGiveNothing) {
  const std::array<Vec3, 3> rays{Vec3(0, 0, 1), Vec3(0.1, 0, 1), Vec3(0.2, 0, 1)};
  EXPECT_EQ(solve_p3p(rays, {Vec3(0, 0, 3), Vec3(1, 0, 3), Vec3(2, 0, 3)}).count, 0);
  EXPECT_EQ(solve_p3p(rays, {Vec3(1, 0, 3), Vec3(1, 0, 3), Vec3(2, 1, 3)}).count, 0);
  EXPECT_EQ(solve_p3p(rays, {Vec3(1, 0, 3), Vec3(1, 0, 3), Vec3(1, 0, 3)}).count, 0);
}

}  // namespace p3p_test
}  // namespace fbvins
