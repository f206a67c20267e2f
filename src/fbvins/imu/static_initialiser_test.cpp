// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/static_initialiser.hpp"

#include <gtest/gtest.h>

#include "tests/support/imu_test_motion.hpp"

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
  const RestEstimate r = initialise_at_rest(window(rest, 1), {});
  ASSERT_TRUE(r.at_rest) << to_string(r.reason);
  EXPECT_LT((r.state.bias.gyro_radps - kBias.gyro_radps).norm(), 1e-3);
  const double explained = kBias.accel_mps2.norm() / kGravity_mps2;  // tilt error that the unknown bias may cause
  EXPECT_LT(tilt_error(r.state, rest.state(3.0)), explained + 1e-3);
  EXPECT_EQ(r.state.v_FB.norm(), 0);
}

TEST(StaticInitialiser, HeadingIsZero) {
  const RestEstimate r = initialise_at_rest(window(Motion(0, 0), 1), {});
  EXPECT_NEAR(so3_log(r.state.T_FB.q).z(), 0, 1e-12);
}

TEST(StaticInitialiser, RefusesMotion) {
  EXPECT_EQ(initialise_at_rest(window(Motion(0.2, 0.2), 1), {}).reason, RestRefusal::gyro_spread);
  EXPECT_EQ(initialise_at_rest(window(Motion(0.2, 0), 1), {}).reason, RestRefusal::accel_spread);
}

TEST(StaticInitialiser, RefusesWhatItCannotJudge) {
  std::vector<ImuSample> samples = window(Motion(0, 0), 1);
  std::vector<ImuSample> turning = samples, heavy = samples, gap = samples;
  for (ImuSample& s : turning) s.gyro_radps.z() += 0.5;
  for (ImuSample& s : heavy) s.accel_mps2 *= 1.2;
  gap.erase(gap.begin() + 50, gap.begin() + 100);
  EXPECT_EQ(initialise_at_rest(turning, {}).reason, RestRefusal::gyro_mean);
  EXPECT_EQ(initialise_at_rest(heavy, {}).reason, RestRefusal::accel_mean);
  EXPECT_EQ(initialise_at_rest(gap, {}).reason, RestRefusal::imu_gap);
  samples.resize(20);
  EXPECT_EQ(initialise_at_rest(samples, {}).reason, RestRefusal::too_short);
  EXPECT_EQ(initialise_at_rest({}, {}).reason, RestRefusal::too_short);
}

// An idling rotor: 60 Hz, 1.5 m/s^2 and 0.1 rad/s, without motion.
TEST(StaticInitialiser, AcceptsVibrationAtRest) {
  std::vector<ImuSample> samples = window(Motion(0, 0), 1);
  for (ImuSample& s : samples) {
    const double wave = std::sin(2 * 3.14159265 * 61.7 * s.t.seconds());
    s.gyro_radps.x() += 0.1 * wave;
    s.accel_mps2.y() += 1.5 * wave;
  }
  const RestEstimate r = initialise_at_rest(samples, {});
  EXPECT_TRUE(r.at_rest) << to_string(r.reason) << " " << r.gyro_spread_radps << " " << r.accel_spread_mps2;
}

}  // namespace static_initialiser_test
}  // namespace fbvins
