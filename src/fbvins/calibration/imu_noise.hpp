// SPDX-License-Identifier: Apache-2.0
// The noise of an IMU from a recording at rest: Allan deviation, and from it white noise and random walk of the biases with 95 %
// bounds (docs/derivations/calibration.md, N1-N6). Minutes give the white noise well; the random walk often only a bound, which
// is said. Pure functions, any thread.
//
//   Result<ImuNoiseResult> found = measure_imu_noise(readings);
//   write(imu_noise_to_kalibr(*found, "/imu0"));
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

struct AllanPoint {
  double tau_s = 0, deviation = 0;  ///< in the sensor's unit
  double low = 0, high = 0;         ///< 95 % bounds
};

/// With 95 % bounds. Where the recording is too short to show a random walk, `low` is zero, and only `high` says something.
struct BoundedNoise {
  double value = 0, low = 0, high = 0;
  bool only_bounded() const { return low == 0; }
};

struct AxisNoise {
  std::vector<AllanPoint> curve;  ///< at one, two, four ... readings
  BoundedNoise density;           ///< unit / sqrt(Hz)
  BoundedNoise random_walk;       ///< unit / s / sqrt(Hz)
  double misfit = 0;              ///< squared sigmas a point by which the curve differs from white noise and random walk: about 1
};

struct ImuNoiseResult {
  std::array<AxisNoise, 3> gyro, accel;
  ImuNoise noise;         ///< the worst axis; a random walk that is only bounded at its bound; range as in ImuNoise
  double duration_s = 0;  ///< of the rest
  Time start;
  std::vector<std::string> warnings;  ///< a sentence each
};

/// The longest rest in the recording. An error where there is none, or none long enough.
Result<ImuNoiseResult> measure_imu_noise(const std::vector<ImuSample>& readings);

/// Overlapping Allan deviation of readings `period_s` apart.
std::vector<AllanPoint> allan_deviation(const std::vector<double>& readings, double period_s);

/// Kalibr's imu.yaml.
std::string imu_noise_to_kalibr(const ImuNoiseResult& result, const std::string& topic);

}  // namespace fbvins
