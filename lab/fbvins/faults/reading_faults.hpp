// SPDX-License-Identifier: Apache-2.0
// What a broken, badly mounted or overloaded IMU does to the numbers of its readings.
//
//   ReadingFaultInjector injector(ReadingFault::vibration, 5, seed);
//   injector.alter(sample);               // each reading from the fault's beginning on
#pragma once

#include <optional>

#include "fbvins/core/rng.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

enum class ReadingFault {
  frozen,           ///< the first reading again and again
  every_fourth,     ///< each reading is delivered four times, with new stamps
  zero,             ///< all numbers are 0
  nan,              ///< not a number
  noise,            ///< white noise of `amount` m/s^2 and 0.06 rad/s for each m/s^2
  vibration,        ///< two tones between 80 and 200 Hz, together `amount` m/s^2 rms and 0.06 rad/s for each m/s^2
  spikes,           ///< one reading of 50 is off by `amount` m/s^2 and 0.1 rad/s for each m/s^2
  gyro_clipped,     ///< each axis measures `amount` rad/s at most
  accel_clipped,    ///< each axis measures `amount` m/s^2 at most
  gyro_bias,        ///< one axis is off by `amount` rad/s
  accel_bias,       ///< one axis is off by `amount` m/s^2
  gyro_drift,       ///< one axis drifts by `amount` rad/s in each second
  gyro_scale,       ///< `amount` percent too large
  accel_scale,      ///< `amount` percent too large
  gyro_axis_dead,   ///< one axis keeps its first number
  accel_axis_dead,  ///< one axis keeps its first number
  gyro_flipped,     ///< one axis has the wrong sign
  axes_exchanged,   ///< x and y of gyroscope and accelerometer
  loose,            ///< the IMU is turned by `amount` degrees against the body
};

/// A value; the same calls give the same bits.
class ReadingFaultInjector {
 public:
  ReadingFaultInjector(ReadingFault fault, double amount, std::uint64_t seed);
  void alter(ImuSample& sample);

 private:
  struct Tone {
    double frequency_hz, phase;
    Vec3 gyro, accel;  ///< unit vectors
  };

  ReadingFault fault_;
  double amount_;
  Rng rng_;
  int axis_;
  Vec3 direction_;
  Tone tones_[2];
  std::optional<ImuSample> first_, held_;
  int count_ = 0;
};

}  // namespace fbvins
