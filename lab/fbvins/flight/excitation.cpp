// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/excitation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

constexpr double kChirp_s = 12, kPause_s = 1, kFade_s = 1;
constexpr double kFrom_hz = 0.3, kTo_hz = 7;
// Limits of amplitude, acceleration and rates.
constexpr double kHorizontal_m = 0.25, kHorizontal_mps2 = 1.8, kTilt_radps = 1.0, kVertical_m = 0.15, kVertical_mps2 = 1.5;
constexpr double kYaw_rad = 0.3, kYaw_radps = 0.8;

/// Angular frequency and phase of an exponential chirp.
struct ChirpState {
  double w, phase;
};
ChirpState chirp(double t_s) {
  const double growth = std::log(kTo_hz / kFrom_hz) / kChirp_s;
  const double w = 2 * std::numbers::pi * kFrom_hz * std::exp(growth * t_s);
  return {w, (w - 2 * std::numbers::pi * kFrom_hz) / growth};
}

double fade(double t_s) { return std::clamp(std::min(t_s, kChirp_s - t_s) / kFade_s, 0.0, 1.0); }

}  // namespace

double excitation_length_s() { return 4 * (kChirp_s + kPause_s); }

PathSetpoint excitation_setpoint(const PathSetpoint& hover, double t_s) {
  PathSetpoint now = hover;
  now.v.setZero(), now.a.setZero(), now.yaw_rate_radps = 0;
  const int axis = std::clamp(static_cast<int>(t_s / (kChirp_s + kPause_s)), 0, 3);
  const double t = t_s - axis * (kChirp_s + kPause_s);
  if (t >= kChirp_s) return now;
  const auto [w, phase] = chirp(t);
  const double s = std::sin(phase), c = std::cos(phase);
  if (axis == 3) {
    const double angle = fade(t) * std::min(kYaw_rad, kYaw_radps / w);
    now.yaw_rad += angle * s;
    now.yaw_rate_radps = angle * w * c;
    return now;
  }
  const double amplitude_m =
      axis == 2 ? std::min(kVertical_m, kVertical_mps2 / (w * w))
                : std::min({kHorizontal_m, kHorizontal_mps2 / (w * w), kTilt_radps * kSimGravity_mps2 / (w * w * w)});
  const double size = fade(t) * amplitude_m;
  now.p[axis] += size * s;
  now.v[axis] = size * w * c;
  now.a[axis] = -size * w * w * s;
  return now;
}

}  // namespace fbvins
