// SPDX-License-Identifier: Apache-2.0
// For tests: a smooth motion known in closed form, with exact velocity, acceleration and angular rate,
// and the readings that a perfect or a noisy IMU would give on it.
#pragma once

#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins::test {

/// Each axis of the position and of the rotation vector is a sum of two sines.
class Motion {
 public:
  /// position_m, rotation_rad: amplitudes; 0 and 0 is rest with the orientation Exp(tilt_rad).
  explicit Motion(double position_m = 0.4, double rotation_rad = 0.3, const Vec3& tilt_rad = Vec3(0.3, -0.5, 1.0))
      : position_m_(position_m), rotation_rad_(rotation_rad), tilt_(so3_exp(tilt_rad)) {}

  /// In a level frame F, that of the motion.
  template <class F = W>
  NavState<F> state(double t, const ImuBias& bias = {}) const {
    NavState<F> s;
    s.T_FB = {(tilt_ * so3_exp(phi(t, 0))).normalized(), p(t, 0)};
    s.v_FB = p(t, 1);
    s.bias = bias;
    return s;
  }
  Vec3 rate_B(double t) const { return so3_right_jacobian(phi(t, 0)) * phi(t, 1); }
  Vec3 specific_force_B(double t, double gravity = kGravity_mps2) const {
    return state(t).T_FB.q.conjugate() * Vec3(p(t, 2) + Vec3(0, 0, gravity));
  }
  ImuSample sample(Time t, const ImuBias& bias = {}) const {
    return {t, rate_B(t.seconds()) + bias.gyro_radps, specific_force_B(t.seconds()) + bias.accel_mps2};
  }

  /// Perfect readings from `from` to `to`, a period apart, the last step possibly shorter.
  ImuSegment segment(Time from, Time to, Duration period, const ImuBias& bias = {}) const {
    ImuSegment s;
    for (Time t = from; t < to; t = t + period) s.samples.push_back(sample(t, bias));
    s.samples.push_back(sample(to, bias));
    s.longest_gap = period;
    return s;
  }

 private:
  // derivative of order d of sum_k a_k sin(w_k t + c_k), d = 0, 1, 2
  static double wave(double t, int d, double w1, double c1, double w2, double c2) {
    const auto one = [&](double w, double c) {
      return d == 0 ? std::sin(w * t + c) : d == 1 ? w * std::cos(w * t + c) : -w * w * std::sin(w * t + c);
    };
    return one(w1, c1) + 0.3 * one(w2, c2);
  }
  Vec3 p(double t, int d) const {
    return position_m_ * Vec3(wave(t, d, 2.1, 0.3, 5.3, 1.0), wave(t, d, 1.7, 1.1, 6.1, 0.2), wave(t, d, 2.9, 2.0, 4.7, 0.5));
  }
  Vec3 phi(double t, int d) const {
    return rotation_rad_ * Vec3(wave(t, d, 2.3, 0.9, 5.9, 0.4), wave(t, d, 1.9, 0.1, 4.9, 2.1), wave(t, d, 2.7, 1.7, 5.1, 0.8));
  }

  double position_m_, rotation_rad_;
  Quat tilt_;
};

inline Vec3 normal3(Rng& rng) {
  const double x = rng.normal(), y = rng.normal();
  return {x, y, rng.normal()};
}

/// White noise as a sensor sampled at noise.rate_hz has it.
inline void add_noise(ImuSegment& segment, const ImuNoise& noise, Rng& rng) {
  const double root_rate = std::sqrt(noise.rate_hz);
  for (ImuSample& s : segment.samples) {
    s.gyro_radps += noise.gyro_noise_density_radps_rthz * root_rate * normal3(rng);
    s.accel_mps2 += noise.accel_noise_density_mps2_rthz * root_rate * normal3(rng);
  }
}

}  // namespace fbvins::test
