// SPDX-License-Identifier: Apache-2.0
// One test for each sentence of docs/conventions.md, named after the sentence's number.
#include <gtest/gtest.h>

#include <concepts>
#include <numbers>

#include "fbvins/imu/imu_residual.hpp"
#include "fbvins/imu/propagation.hpp"
#include "fbvins/imu/static_initialiser.hpp"
#include "fbvins/types/odometry.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins {
namespace conventions_test {

constexpr double kQuarter = std::numbers::pi / 2;

/// Readings of one second, the same throughout.
ImuSegment constant(const Vec3& gyro, const Vec3& accel) {
  ImuSegment s;
  for (int k = 0; k <= 200; ++k) s.samples.push_back({Time{k * 5'000'000}, gyro, accel});
  s.longest_gap = Duration{5'000'000};
  return s;
}

TEST(Conventions, F1_WorldIsZUpAndGravityPointsAlongMinusZ) {
  const NavState<W> thrown =
      propagate(NavState<W>{}, constant(Vec3::Zero(), Vec3::Zero()), level_gravity());  // no force: free fall
  EXPECT_NEAR(thrown.v_FB.z(), -9.81, 1e-9);
  EXPECT_NEAR(thrown.T_FB.p.z(), -4.905, 1e-9);
}

TEST(Conventions, F2_TheAccelerometerAtRestReadsPlusGUpwards) {
  const NavState<W> rest = propagate(NavState<W>{}, constant(Vec3::Zero(), Vec3(0, 0, 9.81)), level_gravity());
  EXPECT_NEAR(rest.v_FB.norm() + rest.T_FB.p.norm(), 0, 1e-9);
}

TEST(Conventions, F3_TWBTakesBodyCoordinatesToTheWorld) {
  const Pose<W, B> T_WB(so3_exp(Vec3(0, 0, kQuarter)), Vec3(10, 0, 0));  // heading along +y, at x = 10
  EXPECT_LT((T_WB * Vec3(1, 0, 0) - Vec3(10, 1, 0)).norm(), 1e-15);
  EXPECT_LT((T_WB * Vec3::Zero() - T_WB.p).norm(), 1e-15);  // p is the body's origin in W
}

template <class A, class B2>
concept Multipliable = requires(A a, B2 b) {
  a* b;
};

TEST(Conventions, F4_InnerFramesCancelAndOthersDoNotCompile) {
  static_assert(std::same_as<decltype(Pose<W, B>() * Pose<B, C0>()), Pose<W, C0>>);
  static_assert(!Multipliable<Pose<W, B>, Pose<C0, W>>);
  static_assert(!Multipliable<Pose<W, B>, Pose<W, B>>);
  static_assert(!Multipliable<Pose<M, W>, Pose<G, B>>);
}

TEST(Conventions, F5_MapPoseIsMapFromWorldTimesWorldFromBody) {
  static_assert(std::same_as<decltype(Pose<M, W>() * Pose<W, B>()), Pose<M, B>>);
}

TEST(Conventions, F6_TheGyroGivesTheBodysRateInTheBody) {
  NavState<W> s;
  s.T_FB.q = so3_exp(Vec3(kQuarter, 0, 0));  // body z lies along -y of W
  const NavState<W> turned = propagate(s, constant(Vec3(0, 0, 1), Vec3::Zero()), Vec3::Zero());
  EXPECT_LT(so3_log((s.T_FB.q * so3_exp(Vec3(0, 0, 1))).conjugate() * turned.T_FB.q).norm(), 1e-12);
}

TEST(Conventions, F7_HeadingZeroIsTheShortestRotationToLevel) {
  const Quat q = level_rotation(Vec3(1, 2, 5));
  EXPECT_LT((q * Vec3(1, 2, 5).normalized() - Vec3::UnitZ()).norm(), 1e-15);
  EXPECT_NEAR(q.z(), 0, 1e-15);
}

TEST(Conventions, R1_QuaternionsAreHamiltonAndWComesFirst) {
  const Quat i(0, 1, 0, 0), j(0, 0, 1, 0), k(0, 0, 0, 1);  // Eigen's constructor: w, x, y, z
  EXPECT_EQ((i * j).coeffs(), k.coeffs());
  const Quat quarter(std::cos(kQuarter / 2), 0, 0, std::sin(kQuarter / 2));
  EXPECT_LT((quarter * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-15);  // active, counter-clockwise
}

TEST(Conventions, R2_ExpOfARotationVectorTurnsAboutItByItsNorm) {
  EXPECT_LT((so3_exp(Vec3(0, 0, kQuarter)) * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-15);
}

TEST(Conventions, R3_RotationsArePerturbedOnTheRight) {
  const Pose<W, B> T(so3_exp(Vec3(0.3, -0.8, 0.5)), Vec3(1, 2, 3));
  const Vec3 d(0.1, -0.2, 0.3);
  EXPECT_LT(so3_log((T.q * so3_exp(d)).conjugate() * T.boxplus(Vec3::Zero(), d).q).norm(), 1e-15);
}

TEST(Conventions, R4_PositionVelocityAndBiasesArePerturbedByAddition) {
  const NavState<W> s = test::Motion().state(0.3);
  Vec15 d = Vec15::Zero();
  d.segment<3>(nav::p) = Vec3(1, 2, 3);
  d.segment<3>(nav::v) = Vec3(4, 5, 6);
  d.segment<3>(nav::bg) = Vec3(7, 8, 9);
  d.segment<3>(nav::ba) = Vec3(10, 11, 12);
  const NavState<W> t = s.boxplus(d);
  EXPECT_LT((t.T_FB.p - s.T_FB.p - Vec3(1, 2, 3)).norm() + (t.v_FB - s.v_FB - Vec3(4, 5, 6)).norm(), 1e-14);
  EXPECT_EQ(t.bias.gyro_radps, Vec3(7, 8, 9));
  EXPECT_EQ(t.bias.accel_mps2, Vec3(10, 11, 12));
}

TEST(Conventions, R5_TheOrderIsPositionRotationVelocityGyroBiasAccelerometerBias) {
  EXPECT_EQ(nav::p, 0);
  EXPECT_EQ(nav::theta, 3);
  EXPECT_EQ(nav::v, 6);
  EXPECT_EQ(nav::bg, 9);
  EXPECT_EQ(nav::ba, 12);
}

TEST(Conventions, I1_AReadingIsTruthPlusBias) {
  NavState<W> s;
  s.bias = {Vec3(0, 0, 0.5), Vec3(1, 0, 0)};
  const NavState<W> still = propagate(s, constant(Vec3(0, 0, 0.5), Vec3(1, 0, 9.81)), level_gravity());
  EXPECT_LT(still.boxminus(s).norm(), 1e-9);
}

TEST(Conventions, I2_DeltasAreInTheFirstBodyFrameWithoutGravity) {
  Preintegration p(ImuNoise{}, {});
  p.integrate(constant(Vec3::Zero(), Vec3(2, 0, 0)));
  EXPECT_LT((p.delta_v() - Vec3(2, 0, 0)).norm() + (p.delta_p() - Vec3(1, 0, 0)).norm(), 1e-12);
  NavState<W> i;
  i.T_FB.q = so3_exp(Vec3(0, 0, kQuarter));
  EXPECT_LT((p.predict(i, Vec3::Zero()).v_FB - Vec3(0, 2, 0)).norm(), 1e-12);
}

TEST(Conventions, I3_DeltaQTakesTheSecondBodyToTheFirst) {
  Preintegration p(ImuNoise{}, {});
  p.integrate(constant(Vec3(0, 0, kQuarter), Vec3::Zero()));  // turns left by 90 degrees
  EXPECT_LT((p.delta_q() * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12);
}

TEST(Conventions, I4_TheResidualIsStatesLessReadings) {
  Preintegration p(ImuNoise{}, {});
  p.integrate(constant(Vec3::Zero(), Vec3(0, 0, 9.81)));
  NavState<W> i, j;
  j.T_FB.p.x() = 0.1;  // a tenth of a metre farther than the readings say
  EXPECT_NEAR(imu_residual(i, j, p, level_gravity())(nav::p), 0.1, 1e-12);
}

TEST(Conventions, U1_TimeIsWholeNanoseconds) {
  static_assert(std::same_as<decltype(Time::ns), std::int64_t>);
  EXPECT_EQ((Time{1'403'636'584'763'555'584} - Time{1'403'636'584'763'555'583}).ns, 1);
}

TEST(Conventions, U2_ADensityTimesTheRootOfTheRateIsTheScatterOfReadings) {
  ImuSegment s = constant(Vec3::Zero(), Vec3::Zero());
  Rng rng(1);
  ImuNoise noise;
  double sum = 0;
  for (int run = 0; run < 50; ++run) {
    ImuSegment noisy = s;
    test::add_noise(noisy, noise, rng);
    for (const ImuSample& x : noisy.samples) sum += x.gyro_radps.squaredNorm() / 3 / (50.0 * noisy.samples.size());
  }
  EXPECT_NEAR(std::sqrt(sum) / (1.6968e-4 * std::sqrt(200.0)), 1, 0.03);
}

TEST(Conventions, U3_CovarianceOfAPoseIsOfPositionInWorldThenRotationInBody) {
  // boxplus of Pose defines it; here: a rotation about body z of a body lying on its side moves no position
  const Pose<W, B> T(so3_exp(Vec3(kQuarter, 0, 0)), Vec3(1, 2, 3));
  const Pose<W, B> moved = T.boxplus(Vec3(0, 0, 1), Vec3(0, 0, 0.1));
  EXPECT_LT((moved.p - Vec3(1, 2, 4)).norm(), 1e-15);
  EXPECT_LT((moved.q * Vec3::UnitZ() - T.q * Vec3::UnitZ()).norm(), 1e-15);  // body z itself stays
  static_assert(std::same_as<decltype(Odometry::pose_covariance), Mat6>);
}

}  // namespace conventions_test
}  // namespace fbvins
