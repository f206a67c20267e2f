// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/imu_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace imu_model_test {

SplineTrajectory at_rest(double seconds) {
  const auto n = static_cast<std::size_t>(seconds / 10) + 6;
  return {10.0, std::vector<Vec3>(n, Vec3::Zero()), std::vector<Quat>(n, Quat::Identity())};
}

SplineTrajectory in_motion() {
  Rng rng(9);
  std::vector<Vec3> p;
  std::vector<Quat> q{Quat::Identity()};
  for (int i = 0; i < 60; ++i) {
    p.emplace_back(rng.normal(), rng.normal(), rng.normal());
    if (i > 0) q.push_back((q.back() * so3_exp(0.3 * Vec3(rng.normal(), rng.normal(), rng.normal()))).normalized());
  }
  return {0.2, p, q};
}

ImuModelOptions ideal() {
  ImuModelOptions options;
  options.noise_factor = 0;
  options.turn_on_gyro_bias_radps = options.turn_on_accel_bias_mps2 = 0;
  options.scale_error = options.misalignment_rad = 0;
  options.vibration_accel_mps2 = options.vibration_gyro_radps = 0;
  options.rumble_accel_mps2_rthz = options.rumble_gyro_radps_rthz = 0;
  options.gyro_step_radps = options.accel_step_mps2 = 0;
  return options;
}

/// Allan deviation of a signal with a reading every dt, for clusters of n readings (overlapping).
double allan_deviation(const std::vector<double>& x, std::size_t n) {
  std::vector<double> sum(x.size() + 1, 0.0);
  for (std::size_t i = 0; i < x.size(); ++i) sum[i + 1] = sum[i] + x[i];
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 * n <= x.size(); ++i, ++count)
    squares += std::pow((sum[i + 2 * n] - 2 * sum[i + n] + sum[i]) / static_cast<double>(n), 2);
  return std::sqrt(0.5 * squares / static_cast<double>(count));
}

// White noise of density s gives s / sqrt(tau); a random walk of density k gives k * sqrt(tau / 3).
TEST(ImuModel, AllanDeviationIsThatOfTheCalibration) {
  ImuNoise noise;
  noise.gyro_random_walk_radps2_rthz = 2e-4;  // large enough to show within an hour
  ImuModelOptions options = ideal();
  options.noise_factor = 1;
  const SimulatedImu imu = simulate_imu(at_rest(3000), noise, options, Time{0}, 4);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> gyro, accel;
    for (const ImuSample& s : imu.samples) {
      gyro.push_back(s.gyro_radps[axis]);
      accel.push_back(s.accel_mps2[axis]);
    }
    for (std::size_t n : {1u, 4u, 20u}) {
      const double tau = static_cast<double>(n) / noise.rate_hz;
      EXPECT_NEAR(allan_deviation(gyro, n) / (noise.gyro_noise_density_radps_rthz / std::sqrt(tau)), 1, 0.03) << axis << " " << n;
      EXPECT_NEAR(allan_deviation(accel, n) / (noise.accel_noise_density_mps2_rthz / std::sqrt(tau)), 1, 0.03)
          << axis << " " << n;
    }
    const std::size_t n = 4000;  // 20 s
    const double walk = noise.gyro_random_walk_radps2_rthz * std::sqrt(20.0 / 3),
                 white = noise.gyro_noise_density_radps_rthz / std::sqrt(20.0);
    EXPECT_NEAR(allan_deviation(gyro, n) / std::hypot(walk, white), 1, 0.25) << axis;
  }
}

TEST(ImuModel, WithoutErrorsItReadsTheTruth) {
  const SplineTrajectory flight = in_motion();
  const SimulatedImu imu = simulate_imu(flight, {}, ideal(), Time{1000}, 1);
  ASSERT_EQ(imu.samples.size(), imu.truth.size());
  for (std::size_t i = 0; i < imu.samples.size(); i += 37) {
    const MotionState m = flight.at((imu.samples[i].t - Time{1000}).seconds());
    EXPECT_LT((imu.samples[i].gyro_radps - m.w_WB_B).norm(), 1e-6);
    EXPECT_LT((imu.samples[i].accel_mps2 - m.specific_force()).norm(), 1e-4);
    EXPECT_LT((imu.truth[i].T_WB.p - m.T_WB.p).norm(), 1e-6);
  }
}

TEST(ImuModel, BiasOfTheTruthIsTheBiasOfTheReadings) {
  ImuModelOptions options = ideal();
  options.turn_on_gyro_bias_radps = 0.05;
  options.turn_on_accel_bias_mps2 = 0.2;
  const SimulatedImu imu = simulate_imu(at_rest(20), {}, options, Time{0}, 3);
  EXPECT_GT(imu.truth[5].bias.gyro_radps.norm(), 0.005);
  EXPECT_LT((imu.samples[5].gyro_radps - imu.truth[5].bias.gyro_radps).norm(), 1e-12);
  EXPECT_LT((imu.samples[5].accel_mps2 - Vec3(0, 0, kSimGravity_mps2) - imu.truth[5].bias.accel_mps2).norm(), 1e-9);
}

TEST(ImuModel, SaturatesAndQuantises) {
  ImuModelOptions options = ideal();
  options.gyro_range_radps = 0.5;
  options.accel_range_mps2 = 9.0;
  options.gyro_step_radps = 0.01;
  const SimulatedImu imu = simulate_imu(in_motion(), {}, options, Time{0}, 1);
  bool saturated = false;
  for (const ImuSample& s : imu.samples)
    for (int i = 0; i < 3; ++i) {
      EXPECT_LE(std::abs(s.gyro_radps[i]), 0.5);
      EXPECT_LE(std::abs(s.accel_mps2[i]), 9.0);
      EXPECT_NEAR(s.gyro_radps[i] / 0.01, std::round(s.gyro_radps[i] / 0.01), 1e-6);
      saturated = saturated || std::abs(s.gyro_radps[i]) == 0.5;
    }
  EXPECT_TRUE(saturated);
}

TEST(ImuModel, VibrationHasItsStrengthInFlightAndNoneAtRest) {
  ImuModelOptions options = ideal();
  options.vibration_accel_mps2 = 0.5;
  const SimulatedImu still = simulate_imu(at_rest(20), {}, options, Time{0}, 2);
  EXPECT_LT((still.samples[1000].accel_mps2 - Vec3(0, 0, kSimGravity_mps2)).norm(), 1e-9);
  const SplineTrajectory flight = in_motion();
  const SimulatedImu shaken = simulate_imu(flight, {}, options, Time{0}, 2);
  double squares = 0, count = 0;
  for (std::size_t i = 200; i < shaken.samples.size(); ++i, ++count)
    squares += (shaken.samples[i].accel_mps2 - flight.at(static_cast<double>(i) / 200).specific_force()).squaredNorm() / 3;
  EXPECT_NEAR(std::sqrt(squares / count), 0.5, 0.1);
}

TEST(ImuModel, TheAxesThatAreToldAreThoseOfTheReadings) {
  ImuModelOptions options = ideal();
  options.scale_error = 0.02, options.misalignment_rad = 0.01;
  const SplineTrajectory motion = in_motion();
  const SimulatedImu imu = simulate_imu(motion, ImuNoise{}, options, Time{0}, 7);
  EXPECT_GT((imu.gyro_axes - Mat3::Identity()).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_GT((imu.accel_axes - imu.gyro_axes).cwiseAbs().maxCoeff(), 0.01);
  for (std::size_t i = 0; i < imu.samples.size(); i += 50) {
    const MotionState truth = motion.at((imu.samples[i].t - Time{0}).seconds());
    EXPECT_LT((imu.samples[i].gyro_radps - imu.gyro_axes * truth.w_WB_B).norm(), 1e-9) << i;
    EXPECT_LT((imu.samples[i].accel_mps2 - imu.accel_axes * truth.specific_force()).norm(), 1e-9) << i;
  }
}

}  // namespace imu_model_test
}  // namespace fbvins
