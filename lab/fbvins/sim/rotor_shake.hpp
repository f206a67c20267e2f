// SPDX-License-Identifier: Apache-2.0
// Vibration by four slightly unbalanced rotors: each gives a tone at its own speed and one an octave above, with the square of
// that speed. One owner.
//
//   RotorShake shake(seed);
//   Shake now = shake.step(rotor_radps / hover_radps, dt);
#pragma once

#include <array>
#include <cstdint>

#include "fbvins/sim/imu_errors.hpp"

namespace fbvins {

class RotorShake {
 public:
  explicit RotorShake(std::uint64_t seed);
  /// `rotors`: speeds over those in hover, at which the strength is that of the options.
  Shake step(const std::array<double, 4>& rotors, double dt_s);

  static constexpr double kHover_hz = 80;  ///< of a rotor's tone in hover

 private:
  struct Rotor {
    double phase_rad = 0;
    Vec3 accel, gyro, accel_octave, gyro_octave;  ///< directions, unit length
  };
  std::array<Rotor, 4> rotors_;
};

}  // namespace fbvins
