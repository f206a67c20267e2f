// SPDX-License-Identifier: Apache-2.0
// Readings of an IMU along a trajectory: white noise, bias random walks, scale and misalignment,
// vibration, quantisation, saturation. Pure functions, any thread.
//
//   SimulatedImu imu = simulate_imu(flight, rig.imu_noise, options, start, seed);
//   imu.samples, imu.truth   // one state and bias a sample
//
// Where the trajectory is not known beforehand, sensor_station.hpp gives reading by reading.
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/sim/spline.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

struct ImuModelOptions {
  double noise_factor = 1.0;
  double turn_on_gyro_bias_radps = 0.03;
  double turn_on_accel_bias_mps2 = 0.2;
  double scale_error = 0.001;
  double misalignment_rad = 0.001;
  double accel_crookedness = 1;
  double vibration_accel_mps2 = 0.25;
  double vibration_gyro_radps = 0.01;
  double rumble_accel_mps2_rthz = 0.03;
  double rumble_gyro_radps_rthz = 6e-4;
  double gyro_range_radps = 17.4;
  double accel_range_mps2 = 176.0;
  double gyro_step_radps = 1.745e-4;
  double accel_step_mps2 = 8.17e-3;
  double stamp_jitter_us = 0;

  template <class V>
  void visit(V&& v) {
    v("noise_factor", noise_factor, "", "factor of the calibration's noise densities and random walks; 0: no noise", 0.0, 100.0);
    v("turn_on_gyro_bias_radps", turn_on_gyro_bias_radps, "rad/s", "standard deviation of the bias at the start", 0.0, 1.0);
    v("turn_on_accel_bias_mps2", turn_on_accel_bias_mps2, "m/s^2", "standard deviation of the bias at the start", 0.0, 5.0);
    v("scale_error", scale_error, "", "standard deviation of each axis' scale, 0.001 is 0.1 %", 0.0, 0.1);
    v("misalignment_rad", misalignment_rad, "rad", "standard deviation of each axis' direction", 0.0, 0.1);
    v("accel_crookedness", accel_crookedness, "", "the accelerometer's errors of scale and direction beside the gyroscope's", 0.0,
      100.0);
    v("vibration_accel_mps2", vibration_accel_mps2, "m/s^2", "rotors in flight: standard deviation on each axis", 0.0, 50.0);
    v("vibration_gyro_radps", vibration_gyro_radps, "rad/s", "rotors in flight: standard deviation on each axis", 0.0, 5.0);
    v("rumble_accel_mps2_rthz", rumble_accel_mps2_rthz, "m/s^2/sqrt(Hz)", "rotors in flight: density of broadband noise", 0.0,
      10.0);
    v("rumble_gyro_radps_rthz", rumble_gyro_radps_rthz, "rad/s/sqrt(Hz)", "rotors in flight: density of broadband noise", 0.0,
      1.0);
    v("gyro_range_radps", gyro_range_radps, "rad/s", "readings saturate here", 0.1, 1000.0);
    v("accel_range_mps2", accel_range_mps2, "m/s^2", "readings saturate here", 1.0, 10000.0);
    v("gyro_step_radps", gyro_step_radps, "rad/s", "quantisation step, 0 for none", 0.0, 0.1);
    v("accel_step_mps2", accel_step_mps2, "m/s^2", "quantisation step, 0 for none", 0.0, 1.0);
    v("stamp_jitter_us", stamp_jitter_us, "us", "noise of the readings' stamps, standard deviation, less than half an interval",
      0.0, 1e4);
  }
};

/// The true state at an instant, as in EuRoC's ground truth.
struct TrueState {
  Time t;
  Pose<W, B> T_WB;
  Vec3 v_WB = Vec3::Zero();
  ImuBias bias;
};

struct SimulatedImu {
  std::vector<ImuSample> samples;
  std::vector<TrueState> truth;
  Mat3 gyro_axes = Mat3::Identity(), accel_axes = Mat3::Identity();  ///< a reading is axes * truth + bias
};

/// Samples at noise.rate_hz over the whole trajectory; the first is at `start`.
SimulatedImu simulate_imu(const SplineTrajectory& flight, const ImuNoise& noise, const ImuModelOptions& options, Time start,
                          std::uint64_t seed);

}  // namespace fbvins
