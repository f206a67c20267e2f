// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

/// Rotation from one sample to the next (eq. P5).
Quat step_rotation(const ImuSample& from, const ImuSample& to, double dt, const Vec3& bias) {
  const Vec3 w0 = from.gyro_radps - bias, w1 = to.gyro_radps - bias;
  return so3_exp(0.5 * dt * (w0 + w1) + dt * dt / 12 * w0.cross(w1));
}

}  // namespace

template <class F>
NavState<F> propagate(const NavState<F>& state, const ImuSegment& segment, const Vec3& gravity_F) {
  NavState<F> s = state;
  for (std::size_t k = 1; k < segment.samples.size(); ++k) {
    const ImuSample &from = segment.samples[k - 1], &to = segment.samples[k];
    const double dt = (to.t - from.t).seconds();
    if (dt <= 0) continue;
    const Vec3 a0 = s.T_FB.q * Vec3(from.accel_mps2 - s.bias.accel_mps2) + gravity_F;
    s.T_FB.q = (s.T_FB.q * step_rotation(from, to, dt, s.bias.gyro_radps)).normalized();
    const Vec3 a1 = s.T_FB.q * Vec3(to.accel_mps2 - s.bias.accel_mps2) + gravity_F;
    s.T_FB.p += dt * s.v_FB + dt * dt / 6 * (2 * a0 + a1);
    s.v_FB += dt / 2 * (a0 + a1);
  }
  return s;
}
template NavState<G> propagate(const NavState<G>&, const ImuSegment&, const Vec3&);
template NavState<W> propagate(const NavState<W>&, const ImuSegment&, const Vec3&);

Quat integrate_gyro(const ImuSegment& segment, const Vec3& gyro_bias_radps) {
  Quat q = Quat::Identity();
  for (std::size_t k = 1; k < segment.samples.size(); ++k) {
    const double dt = (segment.samples[k].t - segment.samples[k - 1].t).seconds();
    if (dt > 0) q = (q * step_rotation(segment.samples[k - 1], segment.samples[k], dt, gyro_bias_radps)).normalized();
  }
  return q;
}

}  // namespace fbvins
