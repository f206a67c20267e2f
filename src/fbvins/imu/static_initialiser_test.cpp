// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/static_initialiser.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "fbvins/imu/imu_test_motion.hpp"

namespace fbvins {
namespace static_initialiser_test {

using test::Motion;
constexpr Time kFrom{2'000'000'000}, kTo{3'000'000'000};
const ImuBias kBias{Vec3(0.02, -0.03, 0.05), Vec3(0.04, -0.05, 0.03)};

std::vector<ImuSample> window(const Motion& motion, std::uint64_t seed) {
  ImuSegment segment = motion.segment(kFrom, kTo, Duration{5'000'000}, kBias);
  Rng rng(seed);
  test::add_noise(segment, {}, rng);
  return segment.samples;
}

/// Angle between the directions of gravity of estimate and truth in B.
double tilt_error(const NavState<G>& estimate, const NavState<W>& truth) {
  const Vec3 a = estimate.T_FB.q.conjugate() * Vec3::UnitZ(), b = truth.T_FB.q.conjugate() * Vec3::UnitZ();
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

TEST(StaticInitialiser, FindsTiltAndGyroBiasAtRest) {
  const Motion rest(0, 0);
  const RestEstimate r = initialise_at_rest(window(rest, 1), 0.1, {});
  ASSERT_TRUE(r.at_rest) << to_string(r.reason);
  EXPECT_LT((r.state.bias.gyro_radps - kBias.gyro_radps).norm(), 1e-3);
  const double explained = kBias.accel_mps2.norm() / kGravity_mps2;  // tilt error that the unknown bias may cause
  EXPECT_LT(tilt_error(r.state, rest.state(3.0)), explained + 1e-3);
  EXPECT_EQ(r.state.v_FB.norm(), 0);
}

TEST(StaticInitialiser, HeadingIsZero) {
  const RestEstimate r = initialise_at_rest(window(Motion(0, 0), 1), 0.1, {});
  EXPECT_NEAR(so3_log(r.state.T_FB.q).z(), 0, 1e-12);
}

// Random accelerometer biases drawn from the prior: the normalised error is chi-square with 8
// degrees of freedom (two of tilt, three of each bias), heading, position and velocity being exact here.
TEST(StaticInitialiser, CovarianceIsConsistent) {
  RestOptions options;
  const Motion rest(0, 0);
  Rng rng(3);
  double nees = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    const ImuBias bias{0.02 * test::normal3(rng), options.accel_bias_sigma_mps2 * test::normal3(rng)};
    ImuSegment segment = rest.segment(kFrom, kTo, Duration{5'000'000}, bias);
    test::add_noise(segment, {}, rng);
    const RestEstimate r = initialise_at_rest(segment.samples, 0, {}, options);
    ASSERT_TRUE(r.at_rest) << to_string(r.reason);
    NavState<G> truth = rest.state<G>(3.0, bias);
    // truth in the estimate's frame: same origin, and the heading that leaves no rotation about gravity
    const Vec3 up_true_B = truth.T_FB.q.conjugate() * Vec3::UnitZ(), up_B = r.state.T_FB.q.conjugate() * Vec3::UnitZ();
    truth.T_FB = {(r.state.T_FB.q * so3_between(up_true_B, up_B)).normalized(), Vec3::Zero()};
    truth.v_FB.setZero();
    const Vec15 e = truth.boxminus(r.state);
    nees += e.dot(r.covariance.ldlt().solve(e)) / kRuns;
  }
  EXPECT_GT(nees, 5.0);
  EXPECT_LT(nees, 9.0);
}

TEST(StaticInitialiser, CovarianceIsPositiveDefinite) {
  const RestEstimate r = initialise_at_rest(window(Motion(0, 0), 1), 0.1, {});
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat15>(r.covariance).eigenvalues().minCoeff(), 0);
  EXPECT_EQ(r.covariance, Mat15(r.covariance.transpose()));
}

TEST(StaticInitialiser, RefusesMotion) {
  EXPECT_EQ(initialise_at_rest(window(Motion(0.2, 0.2), 1), 0.1, {}).reason, RestRefusal::gyro_spread);
  EXPECT_EQ(initialise_at_rest(window(Motion(0.2, 0), 1), 0.1, {}).reason, RestRefusal::accel_spread);
  EXPECT_EQ(initialise_at_rest(window(Motion(0, 0), 1), 5.0, {}).reason, RestRefusal::image_moves);
}

TEST(StaticInitialiser, RefusesWhatItCannotJudge) {
  std::vector<ImuSample> samples = window(Motion(0, 0), 1);
  std::vector<ImuSample> turning = samples, heavy = samples, gap = samples;
  for (ImuSample& s : turning) s.gyro_radps.z() += 0.5;
  for (ImuSample& s : heavy) s.accel_mps2 *= 1.2;
  gap.erase(gap.begin() + 50, gap.begin() + 100);
  EXPECT_EQ(initialise_at_rest(turning, 0, {}).reason, RestRefusal::gyro_mean);
  EXPECT_EQ(initialise_at_rest(heavy, 0, {}).reason, RestRefusal::accel_mean);
  EXPECT_EQ(initialise_at_rest(gap, 0, {}).reason, RestRefusal::imu_gap);
  samples.resize(20);
  EXPECT_EQ(initialise_at_rest(samples, 0, {}).reason, RestRefusal::too_short);
  EXPECT_EQ(initialise_at_rest({}, 0, {}).reason, RestRefusal::too_short);
}

// An idling rotor: 60 Hz, 1.5 m/s^2 and 0.1 rad/s, without motion.
TEST(StaticInitialiser, AcceptsVibrationAtRest) {
  std::vector<ImuSample> samples = window(Motion(0, 0), 1);
  for (ImuSample& s : samples) {
    const double wave = std::sin(2 * 3.14159265 * 61.7 * s.t.seconds());
    s.gyro_radps.x() += 0.1 * wave;
    s.accel_mps2.y() += 1.5 * wave;
  }
  const RestEstimate r = initialise_at_rest(samples, 0.2, {});
  EXPECT_TRUE(r.at_rest) << to_string(r.reason) << " " << r.gyro_spread_radps << " " << r.accel_spread_mps2;
}

}  // namespace static_initialiser_test
}  // namespace fbvins
