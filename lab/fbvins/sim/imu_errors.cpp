// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/imu_errors.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/sim/normal3.hpp"

namespace fbvins {
namespace {

/// Diagonal: scale; off the diagonal: misalignment.
Mat3 crooked_axes(Rng& rng, double scale, double angle) {
  Mat3 m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m(r, c) = r == c ? 1 + scale * rng.normal() : angle * rng.normal();
  return m;
}

Vec3 digitise(const Vec3& x, double step, double range) {
  Vec3 y = x;
  for (int i = 0; i < 3; ++i) {
    if (step > 0) y[i] = step * std::round(x[i] / step);
    y[i] = std::clamp(y[i], -range, range);
  }
  return y;
}

}  // namespace

ImuErrors::ImuErrors(const ImuNoise& noise, const ImuModelOptions& options, std::uint64_t seed)
    : noise_(noise), options_(options), white_(seed, 21), walk_(seed, 22), rumble_(seed, 25), stamps_(seed, 26) {
  Rng constant(seed, 23);
  bias_.gyro_radps = normal3(constant, options.turn_on_gyro_bias_radps);
  bias_.accel_mps2 = normal3(constant, options.turn_on_accel_bias_mps2);
  gyro_axes_ = crooked_axes(constant, options.scale_error, options.misalignment_rad);
  accel_axes_ = crooked_axes(constant, options.accel_crookedness * options.scale_error,
                             options.accel_crookedness * options.misalignment_rad);
}

/// Stamps stay in order.
Duration ImuErrors::stamp_error() {
  if (options_.stamp_jitter_us == 0) return {};
  const double most_s = 0.45 / noise_.rate_hz;
  return Duration::from_seconds(std::clamp(1e-6 * options_.stamp_jitter_us * stamps_.normal(), -most_s, most_s));
}

ImuSample ImuErrors::read(Time t, const MotionState& m, const Shake& shake) {
  const double dt = 1.0 / noise_.rate_hz, k = options_.noise_factor;
  const double root_rate = k * std::sqrt(noise_.rate_hz), in_flight = shake.power * std::sqrt(noise_.rate_hz);
  const Vec3 gyro = gyro_axes_ * (m.w_WB_B + shake.power * options_.vibration_gyro_radps * shake.gyro) + bias_.gyro_radps +
                    normal3(white_, root_rate * noise_.gyro_noise_density_radps_rthz) +
                    normal3(rumble_, in_flight * options_.rumble_gyro_radps_rthz);
  const Vec3 accel = accel_axes_ * (m.specific_force() + shake.power * options_.vibration_accel_mps2 * shake.accel) +
                     bias_.accel_mps2 + normal3(white_, root_rate * noise_.accel_noise_density_mps2_rthz) +
                     normal3(rumble_, in_flight * options_.rumble_accel_mps2_rthz);
  bias_.gyro_radps += normal3(walk_, k * noise_.gyro_random_walk_radps2_rthz * std::sqrt(dt));
  bias_.accel_mps2 += normal3(walk_, k * noise_.accel_random_walk_mps3_rthz * std::sqrt(dt));
  return {t + stamp_error(), digitise(gyro, options_.gyro_step_radps, options_.gyro_range_radps),
          digitise(accel, options_.accel_step_mps2, options_.accel_range_mps2)};
}

}  // namespace fbvins
