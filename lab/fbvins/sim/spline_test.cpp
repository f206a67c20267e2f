// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/spline.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace spline_test {

SplineTrajectory random_flight(std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Vec3> p;
  std::vector<Quat> q{Quat::Identity()};
  const auto vector = [&rng](double s) { return Vec3(s * rng.normal(), s * rng.normal(), s * rng.normal()); };
  for (int i = 0; i < 40; ++i) {
    p.push_back(vector(1.0));
    if (i > 0) q.push_back((q.back() * so3_exp(vector(0.4))).normalized());
  }
  return {0.1, p, q};
}

TEST(Spline, BasisSumsToOneAndIsNotNegative) {
  for (double u = 0; u < 1; u += 0.05) {
    double sum = 0;
    for (double b : bspline_basis<5>(u)) {
      EXPECT_GE(b, 0);
      sum += b;
    }
    EXPECT_NEAR(sum, 1, 1e-14);
  }
  EXPECT_NEAR(bspline_basis<5>(0)[2], 66.0 / 120.0, 1e-15);  // the known values at a knot
  EXPECT_NEAR(bspline_basis<5>(0)[0], 1.0 / 120.0, 1e-15);
}

TEST(Spline, DerivativesAgreeWithDifferences) {
  const SplineTrajectory flight = random_flight(3);
  const double h = 1e-5;
  for (double t = 0.2; t < 3.2; t += 0.0737) {
    const MotionState a = flight.at(t - h), m = flight.at(t), b = flight.at(t + h);
    EXPECT_LT((m.v_WB - (b.T_WB.p - a.T_WB.p) / (2 * h)).norm(), 1e-6 * (1 + m.v_WB.norm()));
    EXPECT_LT((m.a_WB - (b.v_WB - a.v_WB) / (2 * h)).norm(), 1e-5 * (1 + m.a_WB.norm()));
    EXPECT_LT((m.j_WB - (b.a_WB - a.a_WB) / (2 * h)).norm(), 1e-4 * (1 + m.j_WB.norm()));
    const Vec3 w = so3_log(a.T_WB.q.conjugate() * b.T_WB.q) / (2 * h);
    EXPECT_LT((m.w_WB_B - w).norm(), 1e-6 * (1 + w.norm()));
    EXPECT_LT((m.dw_WB_B - (b.w_WB_B - a.w_WB_B) / (2 * h)).norm(), 1e-4 * (1 + m.dw_WB_B.norm()));
  }
}

TEST(Spline, PoseAloneAgreesWithTheFullState) {
  const SplineTrajectory flight = random_flight(4);
  for (double t = 0; t <= flight.duration_s(); t += 0.031) {
    EXPECT_LT((flight.pose(t).p - flight.at(t).T_WB.p).norm(), 1e-14);
    EXPECT_LT(flight.pose(t).q.angularDistance(flight.at(t).T_WB.q), 1e-7);
  }
}

TEST(Spline, DerivativesAreContinuousAtKnots) {
  const SplineTrajectory flight = random_flight(5);
  for (int k = 1; k < 30; ++k) {
    const MotionState a = flight.at(0.1 * k - 1e-9), b = flight.at(0.1 * k + 1e-9);
    EXPECT_LT((a.a_WB - b.a_WB).norm(), 1e-4);
    EXPECT_LT((a.j_WB - b.j_WB).norm(), 1e-2);
    EXPECT_LT((a.dw_WB_B - b.dw_WB_B).norm(), 1e-4);
  }
}

TEST(Spline, RestReadsGravityOnly) {
  const SplineTrajectory flight(0.1, std::vector<Vec3>(10, Vec3(1, 2, 3)), std::vector<Quat>(10, Quat::Identity()));
  EXPECT_LT((flight.at(0.2).specific_force() - Vec3(0, 0, kSimGravity_mps2)).norm(), 1e-12);
  EXPECT_LT(flight.at(0.2).w_WB_B.norm(), 1e-15);
}

}  // namespace spline_test
}  // namespace fbvins
