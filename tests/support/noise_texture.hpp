// SPDX-License-Identifier: Apache-2.0
// For tests: a band-limited random texture with a closed form, so that an image can be rendered under any
// warp with exactly known sub-pixel motion.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Sum of sine waves of random direction and phase with wavelengths from 6 to 120 px and amplitudes that
/// grow with the wavelength, as in natural images. Mean 0, standard deviation about 1.
class NoiseTexture {
 public:
  explicit NoiseTexture(std::uint64_t seed, int waves = 60) {
    Rng rng(seed);
    double power = 0;
    for (int i = 0; i < waves; ++i) {
      const double wavelength = 6.0 * std::pow(20.0, rng.uniform());
      const double k = 2 * std::numbers::pi / wavelength, angle = rng.uniform(0, 2 * std::numbers::pi);
      const double amplitude = std::sqrt(wavelength);
      waves_.push_back({k * std::cos(angle), k * std::sin(angle), rng.uniform(0, 2 * std::numbers::pi), amplitude});
      power += 0.5 * amplitude * amplitude;
    }
    for (Wave& wave : waves_) wave.amplitude /= std::sqrt(power);
  }

  double operator()(const Vec2& p) const {
    double value = 0;
    for (const Wave& wave : waves_) value += wave.amplitude * std::sin(wave.kx * p.x() + wave.ky * p.y() + wave.phase);
    return value;
  }

 private:
  struct Wave {
    double kx, ky, phase, amplitude;
  };
  std::vector<Wave> waves_;
};

/// pixel -> grey value mean + contrast * texture(warp(pixel)) + noise, rounded and clipped.
template <class Warp>
Image render_texture(int width, int height, const NoiseTexture& texture, const Warp& warp, double mean, double contrast,
                     double noise_sigma = 0, std::uint64_t noise_seed = 1) {
  Image image(width, height);
  Rng rng(noise_seed, 7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double value = mean + contrast * texture(warp(Vec2(x, y)));
      if (noise_sigma > 0) value += noise_sigma * rng.normal();
      image.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
    }
  }
  return image;
}

}  // namespace fbvins
