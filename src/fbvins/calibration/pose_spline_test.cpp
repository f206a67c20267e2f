// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/pose_spline.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "tests/support/jacobian_check.hpp"

namespace fbvins {
namespace pose_spline_test {

constexpr double kSpacing_s = 0.1;

std::vector<Pose<T, B>> wild_knots(int count, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Pose<T, B>> knots(1);
  while (static_cast<int>(knots.size()) < count)
    knots.push_back(knots.back().boxplus(Vec3{0.1 * rng.normal(), 0.1 * rng.normal(), 0.1 * rng.normal()},
                                         Vec3{0.4 * rng.normal(), 0.4 * rng.normal(), 0.4 * rng.normal()}));
  return knots;
}

Eigen::VectorXd moved(const SplineMotion& m, const SplineMotion& from) {
  Eigen::VectorXd out(15);
  out << so3_log(from.T_TB.q.conjugate() * m.T_TB.q), m.w_TB_B, m.T_TB.p, m.v_TB, m.a_TB;
  return out;
}

TEST(PoseSpline, RatesAreDerivativesOfThePose) {
  const PoseSpline path(kSpacing_s, wild_knots(12, 1));
  for (double t : {0.03, 0.1, 0.2501, 0.6}) {
    const SplineMotion m = path.at(t);
    const Eigen::MatrixXd d = numeric_jacobian([&](const Eigen::VectorXd& x) { return moved(path.at(t + x(0)), m); }, 1, 1e-3);
    EXPECT_LT((d.block<3, 1>(0, 0) - m.w_TB_B).norm(), 1e-5) << t;
    EXPECT_LT((d.block<3, 1>(6, 0) - m.v_TB).norm(), 1e-6) << t;
    EXPECT_LT((d.block<3, 1>(9, 0) - m.a_TB).norm(), 1e-4) << t;
  }
}

TEST(PoseSpline, IsFourTimesContinuousAtKnots) {
  const PoseSpline path(kSpacing_s, wild_knots(12, 2));
  const Eigen::VectorXd jump = moved(path.at(0.3 - 1e-12), path.at(0.3 + 1e-12));
  EXPECT_LT(jump.head<3>().norm() + (path.at(0.3 - 1e-12).w_TB_B - path.at(0.3 + 1e-12).w_TB_B).norm(), 1e-8);
  EXPECT_LT((path.at(0.3 - 1e-12).a_TB - path.at(0.3 + 1e-12).a_TB).norm(), 1e-8);
}

TEST(PoseSpline, AConstantTurnAndALineAreExact) {
  std::vector<Pose<T, B>> knots;
  const Vec3 step(0.05, -0.1, 0.2), shift(0.01, 0.02, -0.03);
  for (int k = 0; k < 10; ++k) knots.push_back({so3_exp(k * step), Vec3(k * shift)});
  const SplineMotion m = PoseSpline(kSpacing_s, knots).at(0.237);
  EXPECT_LT((m.w_TB_B - step / kSpacing_s).norm(), 1e-12);
  EXPECT_LT((m.v_TB - shift / kSpacing_s).norm(), 1e-12);
  EXPECT_LT(m.a_TB.norm(), 1e-10);
  EXPECT_LT((m.T_TB.p - (0.237 / kSpacing_s + 2) * shift).norm(), 1e-12);
  EXPECT_LT(so3_log(m.T_TB.q.conjugate() * so3_exp((0.237 / kSpacing_s + 2) * step)).norm(), 1e-12);
}

TEST(PoseSpline, JacobiansByAllControlPoints) {
  const std::vector<Pose<T, B>> knots = wild_knots(10, 3);
  const PoseSpline path(kSpacing_s, knots);
  for (double t : {0.0, 0.137, 0.25, 0.49}) {
    SplineJacobian J;
    const SplineMotion m = path.at(t, &J);
    Eigen::MatrixXd analytic = Eigen::MatrixXd::Zero(15, 36);
    for (int j = 0; j < kSplineOrder; ++j) {
      const auto k = static_cast<std::size_t>(j);
      analytic.block<3, 3>(0, 6 * j) = J.J_theta_delta[k];
      analytic.block<3, 3>(3, 6 * j) = J.J_rate_delta[k];
      analytic.block<3, 3>(6, 6 * j + 3) = J.p[k] * Mat3::Identity();
      analytic.block<3, 3>(9, 6 * j + 3) = J.v[k] * Mat3::Identity();
      analytic.block<3, 3>(12, 6 * j + 3) = J.a[k] * Mat3::Identity();
    }
    const auto f = [&](const Eigen::VectorXd& x) {
      std::vector<Pose<T, B>> other = knots;
      for (int j = 0; j < kSplineOrder; ++j) {
        Pose<T, B>& pose = other[static_cast<std::size_t>(J.first + j)];
        pose = pose.boxplus(x.segment<3>(6 * j + 3), x.segment<3>(6 * j));
      }
      return moved(PoseSpline(kSpacing_s, other).at(t), m);
    };
    const JacobianCheck check =
        check_jacobian(f, analytic, {{"rotation", 3}, {"rate", 3}, {"position", 3}, {"velocity", 3}, {"acceleration", 3}},
                       {{"point 0", 6}, {"point 1", 6}, {"point 2", 6}, {"point 3", 6}, {"point 4", 6}, {"point 5", 6}}, 1e-7);
    EXPECT_TRUE(check.ok) << "t = " << t << ": " << check.message;
  }
}

}  // namespace pose_spline_test
}  // namespace fbvins
