// SPDX-License-Identifier: Apache-2.0
// Readings from the true motion, one at a time: bias walk, scale, misalignment, noise, quantisation. One owner.
//
//   ImuErrors errors(noise, options, seed);
//   ImuBias bias = errors.bias();                       // of the reading that comes next
//   ImuSample reading = errors.read(t, motion, shake);
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/imu_model.hpp"

namespace fbvins {

/// Vibration by the rotors: its strength, and vectors of unit variance on each axis.
struct Shake {
  double power = 0;  ///< 0: at rest, 1: that of the options
  Vec3 accel = Vec3::Zero(), gyro = Vec3::Zero();
};

class ImuErrors {
 public:
  ImuErrors(const ImuNoise& noise, const ImuModelOptions& options, std::uint64_t seed);

  const ImuBias& bias() const { return bias_; }
  const Mat3& gyro_axes() const { return gyro_axes_; }
  const Mat3& accel_axes() const { return accel_axes_; }
  /// Readings come at noise.rate_hz.
  ImuSample read(Time t, const MotionState& motion, const Shake& shake);

 private:
  Duration stamp_error();

  ImuNoise noise_;
  ImuModelOptions options_;
  // Each error has its own random numbers, so that switching one off does not change the others.
  Rng white_, walk_, rumble_, stamps_;
  ImuBias bias_;
  Mat3 gyro_axes_, accel_axes_;
};

}  // namespace fbvins
