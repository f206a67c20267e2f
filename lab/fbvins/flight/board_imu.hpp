// SPDX-License-Identifier: Apache-2.0
// The IMU on the flight controller's board: at the vehicle's centre of mass, calibrated, with errors of its own and the same
// rotor vibration. One owner.
//
//   BoardImu imu(250, options, seed);
//   BoardReading reading = imu.read(t_s, vehicle, rotors);
#pragma once

#include "fbvins/flight/flight_controller.hpp"
#include "fbvins/sim/rotor_shake.hpp"

namespace fbvins {

class BoardImu {
 public:
  BoardImu(double rate_hz, ImuModelOptions options, std::uint64_t seed)
      : dt_s_(1 / rate_hz), errors_(noise(rate_hz), calibrated(options), seed + kOtherSeed), shake_(seed + kOtherSeed) {}

  /// `rotors`: rotor speeds divided by the hover speed.
  BoardReading read(double t_s, const Quadrotor& vehicle, const PerRotor& rotors) {
    const MotionState motion = vehicle.motion_of(Pose<BodyFlu, B>{});
    const ImuSample sample = errors_.read(Time{}, motion, shake_.step(rotors, dt_s_));
    return {t_s, sample.accel_mps2, sample.gyro_radps};
  }

 private:
  static constexpr std::uint64_t kOtherSeed = 1'000'003;
  static constexpr double kGyroBias_radps = 0.002, kAccelBias_mps2 = 0.05;

  static ImuNoise noise(double rate_hz) {
    ImuNoise noise;
    noise.rate_hz = rate_hz;
    return noise;
  }
  static ImuModelOptions calibrated(ImuModelOptions options) {
    options.turn_on_gyro_bias_radps = kGyroBias_radps;
    options.turn_on_accel_bias_mps2 = kAccelBias_mps2;
    return options;
  }

  double dt_s_;
  ImuErrors errors_;
  RotorShake shake_;
};

}  // namespace fbvins
