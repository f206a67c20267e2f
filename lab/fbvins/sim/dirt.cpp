// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/dirt.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

/// Of the image's width: radius of a blot, length of a hair and half its width, the blur of a lens's surface.
constexpr double kSmallest = 0.03, kLargest = 0.07, kLength = 0.25, kHalfHair = 0.003, kBlur = 0.005;
/// Light that it takes, and what it reflects: mud is dark, a dried drop bright.
constexpr double kThinnest = 0.65, kThickest = 0.95, kDarkest = 0.03, kBrightest = 0.8;
/// Mean reflectance of a room, by which the light follows from the mean radiance.
constexpr float kMeanReflectance = 0.45f;

/// From 1 inside to 0 outside of an edge, `beyond` it in widths of the blur.
double inside(double beyond) { return 1 / (1 + std::exp(2 * beyond)); }

}  // namespace

Dirt::Dirt(int width, int height, int count, std::uint64_t seed)
    : width_(width), height_(height), opacity_(static_cast<std::size_t>(width) * height, 0.0f), reflectance_(opacity_) {
  Rng rng(79, seed);
  for (int i = 0; i < count; ++i) {
    const double x = width * rng.uniform(0.1, 0.9), y = height * rng.uniform(0.1, 0.9), size = rng.uniform();
    const auto own = seed * 16 + static_cast<std::uint64_t>(i);
    if (i % 3 == 2) add_hair(x, y, kLength * width * (0.5 + size), own);
    else add_blot(x, y, width * (kSmallest + (kLargest - kSmallest) * size), own);
  }
}

void Dirt::cover(int x, int y, double opacity, double reflectance) {
  const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  if (opacity <= opacity_[i]) return;
  opacity_[i] = static_cast<float>(opacity);
  reflectance_[i] = static_cast<float>(reflectance);
}

/// A round outline with waves, and clots inside.
void Dirt::add_blot(double x, double y, double radius, std::uint64_t seed) {
  Rng rng(80, seed);
  const double thick = rng.uniform(kThinnest, kThickest), phases[] = {rng.uniform(), rng.uniform(), rng.uniform(), rng.uniform()};
  const double dark = rng.uniform(kDarkest, kBrightest), bright = rng.uniform(kDarkest, kBrightest);
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      const double r = std::hypot(u - x, v - y), angle = std::atan2(v - y, u - x) / (2 * std::numbers::pi);
      if (r > 2 * radius) continue;
      const auto wave = [&](double turns, double phase) { return std::sin(2 * std::numbers::pi * (turns + phase)); };
      const double edge = radius * (1 + 0.2 * wave(2 * angle, phases[0]) + 0.12 * wave(5 * angle, phases[1]));
      const double clot = 0.5 + 0.5 * wave((u - x) / radius, phases[2]) * wave((v - y) / radius, phases[3]);
      cover(u, v, thick * inside((r - edge) / (kBlur * width_)), dark + (bright - dark) * clot);
    }
}

/// An arc of a circle.
void Dirt::add_hair(double x, double y, double length, std::uint64_t seed) {
  Rng rng(81, seed);
  const double thick = rng.uniform(kThinnest, kThickest), radius = length * rng.uniform(0.5, 2);
  const Vec2 middle(x, y), centre = middle + radius * Vec2(std::cos(7 * thick), std::sin(7 * thick));
  for (int v = 0; v < height_; ++v)
    for (int u = 0; u < width_; ++u) {
      if ((Vec2(u, v) - middle).norm() > 0.5 * length) continue;
      const double off = std::abs((Vec2(u, v) - centre).norm() - radius);
      cover(u, v, thick * inside((off - kHalfHair * width_) / (0.5 * kBlur * width_)), kDarkest);
    }
}

void Dirt::draw(std::vector<float>& radiance) const {
  double sum = 0;
  for (const float value : radiance) sum += std::min(value, 3.0f);  // a lamp counts as what is white
  const float light = static_cast<float>(sum / static_cast<double>(radiance.size())) / kMeanReflectance;
  for (std::size_t i = 0; i < radiance.size(); ++i) radiance[i] += opacity_[i] * (light * reflectance_[i] - radiance[i]);
}

Image Dirt::seen() const {
  Image out(width_, height_, 255);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (opacity_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] >= 0.5f)
        out.at(x, y) = 0;
  return out;
}

}  // namespace fbvins
