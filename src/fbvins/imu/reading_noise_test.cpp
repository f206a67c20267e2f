// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/reading_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace reading_noise_test {

/// Noise of readings as an estimator assumes it.
ImuNoise assumed() {
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = 4e-4;
  noise.accel_noise_density_mps2_rthz = 0.048;
  return noise;
}

/// The scale after a second at 200 Hz, in segments of ten readings with interpolated ends; `alter` changes reading k.
struct Flown {
  ReadingNoise noise;
  ImuNoiseScale newest;
  double largest_gyro = 1;
  int clipped = 0;

  explicit Flown(const std::function<void(int, ImuSample&)>& alter, const ImuNoise& imu = assumed()) : noise(imu) {
    const auto reading = [&](int k) {
      const double t = k * 0.005;
      ImuSample s{Time{} + Duration::from_seconds(t),
                  Vec3(1.5 * std::sin(6 * t), 0.3 + 0.01 * std::sin(20 * t), -2 * std::cos(4 * t)),
                  Vec3(3 * std::sin(5 * t), 1, 9.81 + 4 * std::cos(7 * t))};
      alter(k, s);
      return s;
    };
    for (int first = 0; first < 200; first += 10) {
      ImuSegment segment;
      for (int k = first; k <= first + 10; ++k) segment.samples.push_back(reading(k));
      newest = noise.of(segment);
      largest_gyro = std::max(largest_gyro, newest.gyro);
      clipped += noise.clipped();
    }
  }
};

/// Readings at rest that are noisier than the sensor's own noise by white noise of these sizes.
ImuNoiseScale at_rest_with(double gyro_radps, double accel_mps2) {
  Rng rng(3);
  ReadingNoise noise(assumed());
  ImuNoiseScale out;
  for (int first = 0; first < 400; first += 10) {
    ImuSegment segment;
    for (int k = first; k <= first + 10; ++k)
      segment.samples.push_back({Time{} + Duration::from_seconds(0.005 * k),
                                 gyro_radps * Vec3(rng.normal(), rng.normal(), rng.normal()),
                                 Vec3(0, 0, 9.81) + accel_mps2 * Vec3(rng.normal(), rng.normal(), rng.normal())});
    out = noise.of(segment);
  }
  return out;
}

TEST(ReadingNoise, VibrationIsAddedInQuadrature) {
  const ImuNoise own = assumed();
  const double root_rate = std::sqrt(own.rate_hz);
  const ImuNoiseScale shaken = at_rest_with(0.1, 4);
  EXPECT_NEAR(shaken.gyro, std::hypot(1, 0.25 * 0.1 / root_rate / own.gyro_noise_density_radps_rthz), 0.8);
  EXPECT_NEAR(shaken.accel, std::hypot(1, 4 / root_rate / own.accel_noise_density_mps2_rthz), 1.2);
}

TEST(ReadingNoise, ADeclaredNoiseOfTenTimesTheRealOneCountsLess) {
  const double root_rate = std::sqrt(assumed().rate_hz);
  const ImuNoiseScale calm = at_rest_with(0.1 * assumed().gyro_noise_density_radps_rthz * root_rate,
                                          0.1 * assumed().accel_noise_density_mps2_rthz * root_rate);
  EXPECT_NEAR(calm.gyro, 0.3, 0.08);
  EXPECT_NEAR(calm.accel, 0.3, 0.08);
}

TEST(ReadingNoise, MotionIsNotVibration) {
  Rng rng(1);
  const Flown flown([&](int, ImuSample& s) {
    s.gyro_radps += 0.04 * Vec3(rng.normal(), rng.normal(), rng.normal());
    s.accel_mps2 += 1.2 * Vec3(rng.normal(), rng.normal(), rng.normal());
  });
  EXPECT_LT(flown.largest_gyro, 2.5);
  EXPECT_LT(flown.newest.accel, 2.5);
  EXPECT_NEAR(flown.noise.gyro_vibration_radps(), 0.04, 0.01);
  EXPECT_NEAR(flown.noise.accel_vibration_mps2(), 1.2, 0.3);
  EXPECT_EQ(flown.clipped, 0);
}

TEST(ReadingNoise, StrongVibrationCountsAsOftenAsItIsStronger) {
  Rng rng(2);
  const Flown flown([&](int, ImuSample& s) {
    s.gyro_radps += 0.28 * Vec3(rng.normal(), rng.normal(), rng.normal());
    s.accel_mps2 += 9 * Vec3(rng.normal(), rng.normal(), rng.normal());
  });
  EXPECT_NEAR(flown.newest.gyro, 0.25 * 0.28 / std::sqrt(200) / 4e-4, 3);
  EXPECT_NEAR(flown.newest.accel, 9 / std::sqrt(200) / 0.048, 3);
}

TEST(ReadingNoise, AWrongReadingCountsInItsSegment) {
  const Flown flown([](int k, ImuSample& s) {
    if (k == 104) s.gyro_radps.y() += 3.5;
  });
  // 3.5 rad/s for 5 ms are 17 mrad; as noise of ten intervals of 5 ms.
  const double turned = flown.largest_gyro * assumed().gyro_noise_density_radps_rthz * std::sqrt(0.05);
  EXPECT_GT(turned, 0.012);
  EXPECT_LT(turned, 0.03);
  EXPECT_LE(flown.newest.gyro, 1) << "half a second later";
}

TEST(ReadingNoise, AnAxisAtTheEndOfItsRangeMayBeWrongByAsMuchAgain) {
  const Flown flown([](int, ImuSample& s) { s.gyro_radps = s.gyro_radps.cwiseMax(-0.8).cwiseMin(0.8); });
  EXPECT_GT(flown.clipped, 5);
  EXPECT_GT(flown.largest_gyro * assumed().gyro_noise_density_radps_rthz * std::sqrt(0.05), 0.8 * 0.05 * 0.9);
}

/// Corrected by cross axes, what the sensor gave at the end of its range changes with its other axes.
TEST(ReadingNoise, TheEndOfARangeIsThatOfTheSensorsOwnAxes) {
  ImuNoise imu = assumed();
  imu.axes.gyro << 1.02, 0.03, -0.02, 0.01, 0.97, 0.04, 0.02, -0.03, 1.01;
  imu.axes.gyro_by_force = 1e-3 * Mat3::Ones();
  imu.axes.bias.gyro_radps = Vec3(0.01, -0.02, 0.005);
  const auto at_end = [&](int, ImuSample& s) {
    ImuSample read = s;
    read.gyro_radps = (imu.axes.gyro * s.gyro_radps).cwiseMax(-0.8).cwiseMin(0.8);
    s = corrected(read, imu.axes);
  };
  EXPECT_GT(Flown(at_end, imu).clipped, 5);
  EXPECT_EQ(Flown([](int, ImuSample&) {}, imu).clipped, 0);
  EXPECT_EQ(Flown(at_end).clipped, 0) << "without the axes it cannot be seen";
}

TEST(ReadingNoise, EqualNumbersAtRestAreNotTheEndOfARange) {
  const Flown flown([](int, ImuSample& s) { s.gyro_radps = Vec3(0.01, 0, -0.02), s.accel_mps2 = Vec3(0.1, 0, 9.81); });
  EXPECT_EQ(flown.clipped, 0);
  EXPECT_LE(flown.largest_gyro, 1);
}

TEST(ReadingNoise, RepeatedReadingsAreNotTheEndOfARange) {
  const Flown flown([](int k, ImuSample& s) {
    if (k % 20 < 6) s.gyro_radps = Vec3(0.6, 0.2, 0.1 * (k / 20)), s.accel_mps2 = Vec3(1, 2, 9);
  });
  EXPECT_EQ(flown.clipped, 0);
}

TEST(ReadingNoise, AfterAGapItBeginsAnew) {
  ReadingNoise noise(assumed());
  ImuSegment before, after;
  for (int k = 0; k <= 10; ++k) {
    before.samples.push_back({Time{} + Duration::from_seconds(0.005 * k), Vec3::Zero(), Vec3(0, 0, 9.81)});
    after.samples.push_back({Time{} + Duration::from_seconds(1 + 0.005 * k), Vec3(2, -2, 2), Vec3(5, 0, 9)});
  }
  EXPECT_LE(noise.of(before).gyro, 1);
  EXPECT_LE(noise.of({}).gyro, 1);
  EXPECT_LE(noise.of(after).gyro, 1) << "other numbers after a gap are no blow";
}

}  // namespace reading_noise_test
}  // namespace fbvins
