// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/imu_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/sim/imu_errors.hpp"
#include "fbvins/sim/normal3.hpp"

namespace fbvins {
namespace {

/// Four rotors at slightly different, slowly varying speeds shake every axis.
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

/// Rotors run when the vehicle moves, and spin up and down within half a second.
double rotor_power(const MotionState& m, double last, double dt) {
  const bool moving = m.v_WB.norm() > 0.01 || m.a_WB.norm() > 0.05 || m.w_WB_B.norm() > 0.01;
  return std::clamp(last + (moving ? dt : -dt) / 0.5, 0.0, 1.0);
}

}  // namespace

SimulatedImu simulate_imu(const SplineTrajectory& flight, const ImuNoise& noise, const ImuModelOptions& options, Time start,
                          std::uint64_t seed) {
  const double dt = 1.0 / noise.rate_hz;
  ImuErrors errors(noise, options, seed);
  Rng shaking(seed, 24);
  Vibration vibration(shaking);

  SimulatedImu imu;
  imu.gyro_axes = errors.gyro_axes(), imu.accel_axes = errors.accel_axes();
  double power = 0;
  const int n = static_cast<int>(std::floor(flight.duration_s() * noise.rate_hz)) + 1;
  for (int i = 0; i < n; ++i) {
    const MotionState m = flight.at(i * dt);
    const Time t = start + Duration{static_cast<std::int64_t>(std::llround(i * dt * 1e9))};
    imu.truth.push_back({t, m.T_WB, m.v_WB, errors.bias()});
    power = rotor_power(m, power, dt);
    const auto [shake_accel, shake_gyro] = vibration.step(dt, shaking);
    imu.samples.push_back(errors.read(t, m, {power, shake_accel, shake_gyro}));
  }
  return imu;
}

}  // namespace fbvins
