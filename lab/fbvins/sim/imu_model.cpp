// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/imu_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

Vec3 normal3(Rng& rng, double sigma) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return sigma * Vec3(x, y, z);
}

/// Diagonal: scale; the rest: axes that are not quite at right angles.
Mat3 crooked_axes(Rng& rng, double scale, double angle) {
  Mat3 m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m(r, c) = r == c ? 1 + scale * rng.normal() : angle * rng.normal();
  return m;
}

/// Four rotors at slightly different, slowly wandering speeds shake every axis.
class Vibration {
 public:
  explicit Vibration(Rng& rng) {
    for (Rotor& rotor : rotors_) {
      rotor.hz = rng.uniform(70, 92);
      for (int k = 0; k < 2; ++k) rotor.arm[k] = normal3(rng, 1.0).normalized();
    }
  }
  /// Vectors of unit variance on the average axis, for accelerometer and gyro.
  std::pair<Vec3, Vec3> step(double dt, Rng& rng) {
    Vec3 accel = Vec3::Zero(), gyro = Vec3::Zero();
    for (Rotor& rotor : rotors_) {
      rotor.hz = std::clamp(rotor.hz + 6.0 * std::sqrt(dt) * rng.normal(), 60.0, 98.0);
      rotor.phase = std::fmod(rotor.phase + 2 * std::numbers::pi * rotor.hz * dt, 2 * std::numbers::pi);
      accel += rotor.arm[0] * std::sin(rotor.phase);
      gyro += rotor.arm[1] * std::cos(rotor.phase);
    }
    const double unit = std::sqrt(3.0 * 2.0 / 4.0);
    return {Vec3(unit * accel), Vec3(unit * gyro)};
  }

 private:
  struct Rotor {
    double hz = 80, phase = 0;
    Vec3 arm[2];
  };
  Rotor rotors_[4];
};

Vec3 digitise(const Vec3& x, double step, double range) {
  Vec3 y = x;
  for (int i = 0; i < 3; ++i) {
    if (step > 0) y[i] = step * std::round(x[i] / step);
    y[i] = std::clamp(y[i], -range, range);
  }
  return y;
}

/// Rotors run when the vehicle moves, and spin up and down within half a second.
double rotor_power(const MotionState& m, double last, double dt) {
  const bool moving = m.v_WB.norm() > 0.01 || m.a_WB.norm() > 0.05 || m.w_WB_B.norm() > 0.01;
  return std::clamp(last + (moving ? dt : -dt) / 0.5, 0.0, 1.0);
}

}  // namespace

SimulatedImu simulate_imu(const SplineTrajectory& flight, const ImuNoise& noise, const ImuModelOptions& options, Time start,
                          std::uint64_t seed) {
  // Each error has numbers of its own, so that switching one off leaves the others as they are.
  Rng white(seed, 21), walk(seed, 22), constant(seed, 23), shaking(seed, 24), rumble(seed, 25);
  const double dt = 1.0 / noise.rate_hz, k = options.noise_factor;
  ImuBias bias;
  bias.gyro_radps = normal3(constant, options.turn_on_gyro_bias_radps);
  bias.accel_mps2 = normal3(constant, options.turn_on_accel_bias_mps2);
  const Mat3 gyro_axes = crooked_axes(constant, options.scale_error, options.misalignment_rad);
  const Mat3 accel_axes = crooked_axes(constant, options.scale_error, options.misalignment_rad);
  Vibration vibration(shaking);

  SimulatedImu imu;
  double power = 0;
  const int n = static_cast<int>(std::floor(flight.duration_s() * noise.rate_hz)) + 1;
  for (int i = 0; i < n; ++i) {
    const MotionState m = flight.at(i * dt);
    const Time t = start + Duration{static_cast<std::int64_t>(std::llround(i * dt * 1e9))};
    imu.truth.push_back({t, m.T_WB, m.v_WB, bias});

    power = rotor_power(m, power, dt);
    const auto [shake_accel, shake_gyro] = vibration.step(dt, shaking);
    const double root_rate = k * std::sqrt(noise.rate_hz), in_flight = power * std::sqrt(noise.rate_hz);
    const Vec3 gyro = gyro_axes * (m.w_WB_B + power * options.vibration_gyro_radps * shake_gyro) + bias.gyro_radps +
                      normal3(white, root_rate * noise.gyro_noise_density_radps_rthz) +
                      normal3(rumble, in_flight * options.rumble_gyro_radps_rthz);
    const Vec3 accel = accel_axes * (m.specific_force() + power * options.vibration_accel_mps2 * shake_accel) + bias.accel_mps2 +
                       normal3(white, root_rate * noise.accel_noise_density_mps2_rthz) +
                       normal3(rumble, in_flight * options.rumble_accel_mps2_rthz);
    imu.samples.push_back({t, digitise(gyro, options.gyro_step_radps, options.gyro_range_radps),
                           digitise(accel, options.accel_step_mps2, options.accel_range_mps2)});

    bias.gyro_radps += normal3(walk, k * noise.gyro_random_walk_radps2_rthz * std::sqrt(dt));
    bias.accel_mps2 += normal3(walk, k * noise.accel_random_walk_mps3_rthz * std::sqrt(dt));
  }
  return imu;
}

}  // namespace fbvins
