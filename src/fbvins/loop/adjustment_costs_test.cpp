// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/adjustment_costs.hpp"

#include <gtest/gtest.h>

#include "tests/support/imu_test_motion.hpp"
#include "tests/support/jacobian_check.hpp"

namespace fbvins {
namespace adjustment_costs_test {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Compares every block of a cost's Jacobian with differences of its residual.
void check_cost(const ceres::CostFunction& cost, std::vector<std::vector<double>> x) {
  const auto evaluate = [&](Eigen::VectorXd& r, double** jacobians) {
    std::vector<const double*> blocks;
    for (const auto& block : x) blocks.push_back(block.data());
    r.resize(cost.num_residuals());
    ASSERT_TRUE(cost.Evaluate(blocks.data(), r.data(), jacobians));
  };
  std::vector<RowMajor> J;
  std::vector<double*> pointers;
  for (const auto& block : x) J.emplace_back(cost.num_residuals(), block.size());
  for (RowMajor& j : J) pointers.push_back(j.data());
  Eigen::VectorXd r;
  evaluate(r, pointers.data());
  for (std::size_t b = 0; b < x.size(); ++b) {
    const std::vector<double> start = x[b];
    const auto residual = [&](const Eigen::VectorXd& d) {
      for (std::size_t k = 0; k < start.size(); ++k) x[b][k] = start[k] + d[static_cast<Eigen::Index>(k)];
      Eigen::VectorXd moved;
      evaluate(moved, nullptr);
      x[b] = start;
      return moved;
    };
    const auto check = check_jacobian(residual, J[b], {{"residual", cost.num_residuals()}},
                                      {{"block " + std::to_string(b), static_cast<int>(start.size())}}, 1e-6, 1e-4);
    EXPECT_TRUE(check.ok) << check.message;
  }
}

TEST(ObservationCost, ItsJacobianIsItsDerivative) {
  const Pose<B, C0> camera(so3_exp(Vec3(-1.2, 1.1, -1.3)), Vec3(0.05, -0.02, 0.1));
  const Pose<M, B> T_MB(so3_exp(Vec3(0.3, -0.2, 0.7)), Vec3(1, 2, 3));
  const Vec3 p_M = T_MB * (camera * Vec3(0.4, -0.3, 2.5));
  PlaceFeature seen;
  seen.x = 0.15f, seen.y = -0.1f, seen.inverse_depth = 0.41f, seen.sigma_xy = 0.5f, seen.sigma_inverse_depth = 0.2f;
  check_cost(ObservationCost(T_MB.q, camera, seen),
             {{1, 2, 3, 0.02, -0.03, 0.01}, {p_M.x() + 0.05, p_M.y() - 0.03, p_M.z() + 0.02}});
  seen.inverse_depth = -1;
  check_cost(ObservationCost(T_MB.q, camera, seen), {{1, 2, 3, 0, 0, 0}, {p_M.x(), p_M.y(), p_M.z()}});
}

TEST(ObservationCost, IsZeroWhereThePointWasSeenAndNothingBehindTheCamera) {
  PlaceFeature seen;
  seen.x = 0.25f, seen.y = -0.5f, seen.inverse_depth = 0.5f, seen.sigma_xy = 0.01f, seen.sigma_inverse_depth = 0.01f;
  const ObservationCost cost(Quat::Identity(), {}, seen);
  const auto r = cost.residual({0, 0, 0, 0, 0, 0}, {0.5, -1, 2});
  ASSERT_TRUE(r);
  EXPECT_LT(r->norm(), 1e-9);
  EXPECT_FALSE(cost.residual({0, 0, 0, 0, 0, 0}, {0.5, -1, -2}));
}

class Readings : public testing::Test {
 protected:
  static constexpr double kGravity = 9.81;
  const ImuBias bias_{{0.01, -0.02, 0.015}, {0.2, -0.1, 0.3}};
  const test::Motion motion_{0.4, 0.3};
  const Time from_ = Time{} + Duration::from_seconds(1), to_ = Time{} + Duration::from_seconds(1.25);

  std::shared_ptr<const Preintegration> between(const ImuBias& linearised_at) const {
    Preintegration imu({}, linearised_at);
    imu.integrate(motion_.segment(from_, to_, Duration::from_seconds(0.001), bias_));
    return std::make_shared<const Preintegration>(imu);
  }
  std::vector<double> pose(Time t, const Quat& start) const {
    const NavState<M> s = motion_.state<M>(t.seconds());
    const Quat d = start.conjugate() * s.T_FB.q;  // (1, x/2) normalised
    return {s.T_FB.p.x(), s.T_FB.p.y(), s.T_FB.p.z(), 2 * d.x() / d.w(), 2 * d.y() / d.w(), 2 * d.z() / d.w()};
  }
  std::vector<double> motion(Time t) const {
    const Vec3 v = motion_.state<M>(t.seconds()).v_FB, &g = bias_.gyro_radps, &a = bias_.accel_mps2;
    return {v.x(), v.y(), v.z(), g.x(), g.y(), g.z(), a.x(), a.y(), a.z()};
  }
};

TEST_F(Readings, HaveNoResidualAtTheTruth) {
  const Quat q_i = motion_.state<M>(1).T_FB.q * so3_exp(Vec3(0.02, 0, 0.03)), q_j = motion_.state<M>(1.25).T_FB.q;
  const ImuCost cost(q_i, q_j, between(bias_), kGravity);
  const std::vector<double> x[] = {pose(from_, q_i), motion(from_), pose(to_, q_j), motion(to_), {0, 0}};
  const double* blocks[] = {x[0].data(), x[1].data(), x[2].data(), x[3].data(), x[4].data()};
  Vec15 r;
  ASSERT_TRUE(cost.Evaluate(blocks, r.data(), nullptr));
  EXPECT_LT(r.norm(), 0.1) << "in standard deviations; what is left is due to the readings' sampling";
  const std::vector<double> tilted{0.02, 0};
  blocks[4] = tilted.data();
  ASSERT_TRUE(cost.Evaluate(blocks, r.data(), nullptr));
  EXPECT_GT(r.norm(), 10) << "a degree of tilt is not overlooked";
}

TEST_F(Readings, TheirJacobianIsItsDerivative) {
  const Quat q_i = motion_.state<M>(1).T_FB.q * so3_exp(Vec3(0.02, 0, 0.03)), q_j = motion_.state<M>(1.25).T_FB.q;
  std::vector<std::vector<double>> x = {pose(from_, q_i), motion(from_), pose(to_, q_j), motion(to_), {0.03, -0.02}};
  x[2][0] += 0.01, x[2][4] += 0.02, x[3][1] -= 0.05, x[1][7] += 0.1;
  // Noise of unit weight, so that its scale does not hide errors of the Jacobian.
  ImuNoise loud;
  loud.gyro_noise_density_radps_rthz = loud.accel_noise_density_mps2_rthz = 1;
  loud.gyro_random_walk_radps2_rthz = loud.accel_random_walk_mps3_rthz = 1;
  Preintegration imu(loud, {});
  imu.integrate(motion_.segment(from_, to_, Duration::from_seconds(0.005), bias_));
  check_cost(ImuCost(q_i, q_j, std::make_shared<const Preintegration>(imu), kGravity), x);
}

}  // namespace adjustment_costs_test
}  // namespace fbvins
