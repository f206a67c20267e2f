// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace imu_noise_test {

constexpr double kGyro = 1.7e-4, kAccel = 2e-3;

Vec3 white_noise(Rng& rng, double sigma) { return Vec3{sigma * rng.normal(), sigma * rng.normal(), sigma * rng.normal()}; }

std::vector<ImuSample> rest(double duration_s, double gyro_walk, double accel_walk, std::uint64_t seed, double rate_hz = 100) {
  Rng rng(seed);
  Vec3 bg = white_noise(rng, 0.01), ba = white_noise(rng, 0.05);
  std::vector<ImuSample> out;
  for (int i = 0; i < static_cast<int>(duration_s * rate_hz); ++i) {
    out.push_back({Time{} + Duration::from_seconds(i / rate_hz), bg + white_noise(rng, kGyro * std::sqrt(rate_hz)),
                   Vec3(0, 0, 9.81) + ba + white_noise(rng, kAccel * std::sqrt(rate_hz))});
    bg += white_noise(rng, gyro_walk / std::sqrt(rate_hz)), ba += white_noise(rng, accel_walk / std::sqrt(rate_hz));
  }
  return out;
}

bool within(const BoundedNoise& n, double truth) { return n.low <= truth && truth <= n.high; }

TEST(ImuNoise, AllanDeviationOfKnownNumbers) {
  // Means of pairs differ by 2, 2, 2 at m = 2: variance 4 / 2.
  const std::vector<AllanPoint> curve = allan_deviation({0, 0, 2, 2, 0, 0, 2, 2, 0, 0, 2, 2, 0, 0, 2, 2}, 0.5);
  EXPECT_DOUBLE_EQ(curve[1].tau_s, 1);
  // Of overlapping pairs every second difference is 0 or +-2.
  EXPECT_NEAR(curve[1].deviation, std::sqrt(7 * 4 / 13.0 / 2), 1e-12);
}

TEST(ImuNoise, DensitiesAndWalksWithTheirBounds) {
  int density_inside = 0, walk_inside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto found = measure_imu_noise(rest(300, 2e-5, 1e-3, seed));
    ASSERT_TRUE(found) << found.error().message;
    for (const AxisNoise& axis : found->accel) {
      EXPECT_NEAR(axis.density.value, kAccel, 0.1 * kAccel);
      EXPECT_FALSE(axis.random_walk.only_bounded());
      density_inside += within(axis.density, kAccel), walk_inside += within(axis.random_walk, 1e-3), ++all;
    }
    EXPECT_NEAR(found->noise.rate_hz, 100, 1e-9);
  }
  EXPECT_GE(density_inside, 26) << "of " << all;
  EXPECT_GE(walk_inside, 26) << "of " << all;
}

TEST(ImuNoise, AShortRestOnlyBoundsTheRandomWalk) {
  const auto found = measure_imu_noise(rest(40, 2e-6, 2e-5, 3));
  ASSERT_TRUE(found) << found.error().message;
  int bounded = 0;
  for (const AxisNoise& axis : found->gyro) {
    bounded += axis.random_walk.only_bounded();
    EXPECT_GT(axis.random_walk.high, 2e-6);
    EXPECT_TRUE(within(axis.density, kGyro)) << axis.density.low << " " << axis.density.high;
  }
  EXPECT_GE(bounded, 2);
  EXPECT_GE(found->noise.gyro_random_walk_radps2_rthz, 2e-6);
  ASSERT_GE(found->warnings.size(), 2u);
  EXPECT_NE(found->warnings[0].find("40 s of rest are short"), std::string::npos) << found->warnings[0];
  EXPECT_NE(found->warnings[1].find("only bounded"), std::string::npos) << found->warnings[1];
  const std::string yaml = imu_noise_to_kalibr(*found, "/imu0");
  EXPECT_NE(yaml.find("gyroscope_noise_density: 0.0001"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("rostopic: /imu0"), std::string::npos);
}

TEST(ImuNoise, TakesTheRestOutOfARecordingThatIsDisturbed) {
  std::vector<ImuSample> readings = rest(100, 2e-5, 1e-3, 5);
  Rng rng(6);
  for (std::size_t i = 2000; i < 2300; ++i)
    readings[i].gyro_radps += white_noise(rng, 0.5), readings[i].accel_mps2 += white_noise(rng, 1);
  const auto found = measure_imu_noise(readings);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->duration_s, 77, 1.5);
  EXPECT_NEAR(found->gyro[0].density.value, kGyro, 0.1 * kGyro);
  EXPECT_NE(found->warnings.front().find("not at rest"), std::string::npos);
}

TEST(ImuNoise, RefusesWhatIsNoRest) {
  EXPECT_NE(measure_imu_noise(rest(5, 0, 0, 1)).error().message.find("too short"), std::string::npos);
  std::vector<ImuSample> carried = rest(60, 0, 0, 2);
  for (std::size_t i = 0; i < carried.size(); ++i) carried[i].gyro_radps.x() += 0.5 * std::sin(0.02 * static_cast<double>(i));
  EXPECT_NE(measure_imu_noise(carried).error().message.find("longest rest"), std::string::npos);
  std::vector<ImuSample> in_g = rest(60, 0, 0, 2);
  for (ImuSample& s : in_g) s.accel_mps2 /= 9.81;
  EXPECT_NE(measure_imu_noise(in_g).error().message.find("unit"), std::string::npos);
  EXPECT_FALSE(measure_imu_noise({}));
}

}  // namespace imu_noise_test
}  // namespace fbvins
