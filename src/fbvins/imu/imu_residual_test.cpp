// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/imu_residual.hpp"

#include <gtest/gtest.h>

#include "tests/support/integrated_test_motion.hpp"
#include "tests/support/jacobian_check.hpp"

namespace fbvins {
namespace imu_residual_test {

using test::integrated;
using test::kBias;
using test::kFrom;
using test::kTo;
using test::Motion;

const std::vector<JacobianBlock> kBlocks = {{"p", 3}, {"theta", 3}, {"v", 3}, {"bg", 3}, {"ba", 3}};

struct TwoStates {
  NavState<W> i, j;
  Preintegration between;
};

TwoStates two_states() {
  const Motion motion;
  TwoStates s{
      motion.state(kFrom.seconds(), kBias), motion.state(kTo.seconds(), kBias),
      integrated(motion.segment(kFrom, kTo, Duration{5'000'000}, kBias), ImuBias{Vec3(0.01, -0.02, 0.04), Vec3(0, -0.1, 0.1)})};
  Rng rng(5);
  Vec15 d;
  for (int k = 0; k < 15; ++k) d(k) = 0.05 * rng.normal();  // far from the solution, so that no term vanishes
  s.j = s.j.boxplus(d);
  return s;
}

TEST(ImuResidual, VanishesAtThePredictedState) {
  TwoStates s = two_states();
  s.j = s.between.predict(s.i, level_gravity());
  EXPECT_LT(imu_residual(s.i, s.j, s.between, level_gravity()).norm(), 1e-12);
}

TEST(ImuResidual, JacobiansMatchNumericOnes) {
  const TwoStates s = two_states();
  Mat15 J_i, J_j;
  imu_residual(s.i, s.j, s.between, level_gravity(), &J_i, &J_j);
  const auto by_i = check_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return imu_residual(s.i.boxplus(d), s.j, s.between, level_gravity()); },
      J_i, kBlocks, kBlocks, 1e-9);
  const auto by_j = check_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return imu_residual(s.i, s.j.boxplus(d), s.between, level_gravity()); },
      J_j, kBlocks, kBlocks, 1e-9);
  EXPECT_TRUE(by_i.ok) << by_i.message;
  EXPECT_TRUE(by_j.ok) << by_j.message;
}

TEST(ImuResidual, WeightedIsTheRootOfTheInformationTimesTheResidual) {
  const TwoStates s = two_states();
  Mat15 J_i, J_j, WJ_i, WJ_j;
  const Mat15& U = s.between.sqrt_information();
  const Vec15 r = imu_residual(s.i, s.j, s.between, level_gravity(), &J_i, &J_j);
  const Vec15 wr = weighted_imu_residual(s.i, s.j, s.between, level_gravity(), &WJ_i, &WJ_j);
  EXPECT_LT((wr - U * r).norm() / wr.norm(), 1e-13);
  EXPECT_LT((WJ_i - U * J_i).norm() / WJ_i.norm(), 1e-13);
  EXPECT_LT((WJ_j - U * J_j).norm() / WJ_j.norm(), 1e-13);
}

TEST(ImuResidual, FirstEstimatesMoveTheJacobiansAndNotTheResidual) {
  const TwoStates s = two_states();
  Vec15 d = Vec15::Constant(0.02);
  const NavState<W> i_lin = s.i.boxplus(d), j_lin = s.j.boxplus(-d);
  Mat15 J_i, J_j, at_lin_i, at_lin_j;
  const Vec15 r = weighted_imu_residual(s.i, s.j, i_lin, j_lin, s.between, level_gravity(), &J_i, &J_j);
  weighted_imu_residual(i_lin, j_lin, s.between, level_gravity(), &at_lin_i, &at_lin_j);
  EXPECT_EQ(r, weighted_imu_residual(s.i, s.j, s.between, level_gravity()));
  EXPECT_EQ(J_i, at_lin_i);
  EXPECT_EQ(J_j, at_lin_j);
}

// Position of the world, heading: moving both states together by them changes no residual.
TEST(ImuResidual, DoesNotSeeOriginAndHeading) {
  const TwoStates s = two_states();
  const Quat yaw = so3_exp(Vec3(0, 0, 0.7));
  const auto moved = [&](NavState<W> x) {
    x.T_FB = {yaw * x.T_FB.q, yaw * x.T_FB.p + Vec3(3, -4, 5)};
    x.v_FB = yaw * x.v_FB;
    return x;
  };
  const Vec15 r = imu_residual(s.i, s.j, s.between, level_gravity());
  EXPECT_LT((imu_residual(moved(s.i), moved(s.j), s.between, level_gravity()) - r).norm(), 1e-12);
}

}  // namespace imu_residual_test
}  // namespace fbvins
