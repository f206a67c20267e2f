// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/rotor_shake.hpp"

#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

/// Amplitude of the octave over that of the tone.
constexpr double kOctave = 0.4;

Vec3 direction(Rng& rng) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return Vec3(x, y, z).normalized();
}

}  // namespace

RotorShake::RotorShake(std::uint64_t seed) {
  Rng rng(seed, 26);
  for (Rotor& rotor : rotors_) {
    rotor.phase_rad = rng.uniform(0, 2 * std::numbers::pi);
    for (Vec3* d : {&rotor.accel, &rotor.gyro, &rotor.accel_octave, &rotor.gyro_octave}) *d = direction(rng);
  }
}

// The force of an imbalance grows with the square of the speed.
Shake RotorShake::step(const std::array<double, 4>& rotors, double dt_s) {
  Shake shake;
  for (std::size_t i = 0; i < rotors_.size(); ++i) {
    Rotor& r = rotors_[i];
    r.phase_rad = std::fmod(r.phase_rad + 2 * std::numbers::pi * kHover_hz * rotors[i] * dt_s, 2 * std::numbers::pi);
    const double strength = rotors[i] * rotors[i];
    shake.accel += strength * (std::sin(r.phase_rad) * r.accel + kOctave * std::sin(2 * r.phase_rad) * r.accel_octave);
    shake.gyro += strength * (std::cos(r.phase_rad) * r.gyro + kOctave * std::cos(2 * r.phase_rad) * r.gyro_octave);
    shake.power += 0.25 * strength;
  }
  // Four tones of variance 1/2 each along their directions, with their octaves: one on each axis, together.
  const double unit = std::sqrt(3.0 * 2.0 / 4.0 / (1 + kOctave * kOctave));
  // The vectors contain the strength already, and are divided by `power`, with which ImuErrors multiplies.
  const double by_power = shake.power > 1e-9 ? unit / shake.power : 0;
  shake.accel *= by_power;
  shake.gyro *= by_power;
  return shake;
}

}  // namespace fbvins
