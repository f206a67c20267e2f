// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/propellers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

/// Of the image's width: a blade's length and half its chord.
constexpr double kBladeLength = 0.36, kHalfChord = 0.018;
/// Of black blades in the light that falls into the view, and how often a small vehicle's turn.
constexpr float kReflectance = 0.06f;
constexpr double kSlowest_hz = 90, kFastest_hz = 130;
/// Over which the exposure is summed up.
constexpr int kInstants = 24;

}  // namespace

Propellers::Propellers(int width, int height, int count, int camera) : width_(width), height_(height) {
  Rng rng(78, static_cast<std::uint64_t>(camera));
  for (int i = 0; i < count; ++i) {
    const double beyond = rng.uniform(0.02, 0.1) * width, above = rng.uniform(0.02, 0.1) * width;
    const double x = i % 2 == 0 ? -beyond : width + beyond, turns = (i % 2 == 0 ? 1 : -1) * rng.uniform(kSlowest_hz, kFastest_hz);
    propellers_.push_back({Vec2(x, -above), turns, rng.uniform()});
  }
}

/// Of a pixel from the hub; negative where no blade reaches.
double Propellers::radius_px(const Propeller& propeller, int x, int y) const {
  const double r = (Vec2(x, y) - propeller.hub).norm();
  return r < kBladeLength * width_ && r > 1 ? r : -1;
}

void Propellers::draw(std::vector<float>& radiance, double t_s, double exposure_s, double line_delay_s) const {
  double sum = 0;
  for (const float value : radiance) sum += std::min(value, 1.0f);
  const float blade = kReflectance * static_cast<float>(sum / static_cast<double>(radiance.size()));
  for (const Propeller& propeller : propellers_)
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const double r = radius_px(propeller, x, y);
        if (r < 0) continue;
        // In half turns, after which the other blade is where this one was.
        const Vec2 from = Vec2(x, y) - propeller.hub;
        const double at = std::atan2(from.y(), from.x()) / std::numbers::pi,
                     half_width = kHalfChord * width_ / r / std::numbers::pi;
        const double row_s = t_s + (y - 0.5 * height_) * line_delay_s;
        int covered = 0;
        for (int i = 0; i < kInstants; ++i) {
          const double t = row_s + exposure_s * ((i + 0.5) / kInstants - 0.5);
          const double off = at - 2 * (propeller.turns_per_s * t + propeller.phase);
          covered += std::abs(off - std::round(off)) < half_width;
        }
        const float share = static_cast<float>(covered) / kInstants;
        float& pixel = radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
        pixel = (1 - share) * pixel + share * blade;
      }
}

Image Propellers::reach() const {
  Image out(width_, height_, 255);
  for (const Propeller& propeller : propellers_)
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        if (radius_px(propeller, x, y) >= 0) out.at(x, y) = 0;
  return out;
}

}  // namespace fbvins
