// SPDX-License-Identifier: Apache-2.0
// Shapes dropped on one another with radii of density 1/r^3 have the spectrum and the edges of natural images
// (the "dead leaves" model). Each leaf here is an ellipse, a box, a triangle or a ring with a texture of its own.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "training/native/warped_pair.hpp"

namespace fbvins {
namespace {

enum class Shape { ellipse, box, triangle, ring };
enum class Paint { flat, noise, stripes, checks, speckle, fibres };

struct Leaf {
  Shape shape;
  Paint paint;
  double x, y, rx, ry, c, s;      // position, half axes, direction
  double grey, slope_x, slope_y;  // shading
  double contrast, period, phase;
  std::uint32_t key;
};

std::uint32_t hashed(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

double lattice(int x, int y, std::uint32_t key) {
  return hashed(static_cast<std::uint32_t>(x) * 73856093u ^ static_cast<std::uint32_t>(y) * 19349663u ^ key) * 0x1p-32;
}

/// Smooth noise of unit cells in [0, 1].
double value_noise(double x, double y, std::uint32_t key) {
  const double fx = std::floor(x), fy = std::floor(y);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const auto soft = [](double t) { return t * t * (3 - 2 * t); };
  const double u = soft(x - fx), v = soft(y - fy);
  const double a = lattice(ix, iy, key), b = lattice(ix + 1, iy, key), c = lattice(ix, iy + 1, key),
               d = lattice(ix + 1, iy + 1, key);
  return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
}

bool covers(const Leaf& l, double u, double v) {
  u /= l.rx, v /= l.ry;
  switch (l.shape) {
    case Shape::ellipse: return u * u + v * v < 1;
    case Shape::box: return std::abs(u) < 1 && std::abs(v) < 1;
    case Shape::triangle: return v > -1 && v < 1 - 2 * std::abs(u);
    case Shape::ring: {
      const double r2 = u * u + v * v;
      return r2 < 1 && r2 > 0.6;
    }
  }
  return false;
}

double texture(const Leaf& l, double u, double v) {
  const double p = l.period;
  switch (l.paint) {
    case Paint::flat: return 0;
    case Paint::noise: {
      double sum = 0, weight = 0.6;
      for (int octave = 0; octave < 4; ++octave, weight *= 0.6)
        sum += weight *
               (value_noise(u / p * (1 << octave) + 40, v / p * (1 << octave) + 40, l.key + static_cast<std::uint32_t>(octave)) -
                0.5);
      return 2 * sum;
    }
    case Paint::stripes: return std::sin(2 * std::numbers::pi * u / p + l.phase) > 0 ? 0.5 : -0.5;
    case Paint::checks: return (static_cast<int>(std::floor(u / p)) + static_cast<int>(std::floor(v / p))) & 1 ? 0.5 : -0.5;
    case Paint::fibres: {  // grass, fur, wood: noise stretched along one direction
      double sum = 0, weight = 0.7;
      for (int octave = 0; octave < 3; ++octave, weight *= 0.7)
        sum += weight * (value_noise(u / p * 0.15 * (1 << octave) + 70, 2 * v / p * (1 << octave) + 70,
                                     l.key + static_cast<std::uint32_t>(octave)) -
                         0.5);
      return 2 * sum;
    }
    case Paint::speckle:
      return lattice(static_cast<int>(std::floor(2 * u / p)), static_cast<int>(std::floor(2 * v / p)), l.key) - 0.5;
  }
  return 0;
}

struct Style {
  double smallest_px, largest_px;  // of the radii
  double roughness;                // contrast of textures
  double flat, repeats;            // shares of leaves
  bool large_first;
};

Style random_style(Rng& rng) {
  Style s;
  s.smallest_px = std::exp(rng.uniform(std::log(1.2), std::log(9.0)));
  s.largest_px = rng.uniform(60, 300);
  s.roughness = rng.uniform(0.1, 1);
  s.flat = rng.uniform(0.05, 0.35);
  s.repeats = rng.uniform() < 0.5 ? 0 : rng.uniform(0, 0.15);
  s.large_first = rng.uniform() < 0.5;
  return s;
}

/// Radii of density 1/r^3.
double random_radius(double smallest, double largest, Rng& rng) {
  const double a = 1 / (smallest * smallest), b = 1 / (largest * largest);
  return 1 / std::sqrt(a + (b - a) * rng.uniform());
}

Leaf random_leaf(int width, int height, double r, const Style& style, Rng& rng) {
  Leaf l{};
  l.shape = static_cast<Shape>(rng.below(4));
  const double aspect = std::exp(rng.uniform(-1.6, 1.6) * rng.uniform());
  l.rx = r * std::sqrt(aspect), l.ry = r / std::sqrt(aspect);
  l.x = rng.uniform(-20, width + 20), l.y = rng.uniform(-20, height + 20);
  const double angle = rng.uniform() < 0.4 ? 0.05 * rng.normal() : rng.uniform(0, 2 * std::numbers::pi);
  l.c = std::cos(angle), l.s = std::sin(angle);
  l.grey = rng.uniform(10, 245);
  const double shading = 60 * rng.uniform() * rng.uniform();
  l.slope_x = rng.uniform(-1, 1) * shading, l.slope_y = rng.uniform(-1, 1) * shading;
  l.paint = rng.uniform() < style.flat ? Paint::flat
            : rng.uniform() < 0.7      ? (rng.uniform() < 0.7 ? Paint::noise : Paint::fibres)
                                       : static_cast<Paint>(1 + rng.below(5));
  l.contrast = style.roughness * std::exp(rng.uniform(std::log(4.0), std::log(130.0)));
  l.period = std::exp(rng.uniform(std::log(3.0), std::log(60.0)));
  l.phase = rng.uniform(0, 6.28);
  l.key = rng.next_u32();
  return l;
}

/// Twice the picture's resolution, averaged at the end against aliasing.
class Canvas {
 public:
  Canvas(int width, int height, double grey)
      : w_(2 * width),
        h_(2 * height),
        v_(static_cast<std::size_t>(w_) * static_cast<std::size_t>(h_), static_cast<float>(grey)) {}
  int width() const { return w_; }
  int height() const { return h_; }
  float& at(int x, int y) { return v_[static_cast<std::size_t>(y) * static_cast<std::size_t>(w_) + static_cast<std::size_t>(x)]; }

  void drop(const Leaf& l) {
    const double reach = std::hypot(l.rx, l.ry);
    const int x0 = std::max(0, static_cast<int>(l.x - reach)), x1 = std::min(w_ - 1, static_cast<int>(l.x + reach));
    const int y0 = std::max(0, static_cast<int>(l.y - reach)), y1 = std::min(h_ - 1, static_cast<int>(l.y + reach));
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const double dx = x - l.x, dy = y - l.y, u = l.c * dx + l.s * dy, v = -l.s * dx + l.c * dy;
        if (!covers(l, u, v)) continue;
        at(x, y) =
            static_cast<float>(l.grey + l.slope_x * u / l.rx + l.slope_y * v / l.ry + l.contrast * texture(l, 0.5 * u, 0.5 * v));
      }
  }

  /// The same leaf repeated in rows: windows, bricks, tiles.
  void drop_in_rows(Leaf l, Rng& rng) {
    const double step = rng.uniform(2.1, 4), turn = rng.uniform() < 0.7 ? 0.0 : rng.uniform(0, 1.5);
    const int columns = 1 + static_cast<int>(rng.below(10)), rows = 1 + static_cast<int>(rng.below(6));
    const double x0 = l.x, y0 = l.y;
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i) {
        const double a = i * step * l.rx, b = j * step * l.ry;
        l.x = x0 + std::cos(turn) * a - std::sin(turn) * b;
        l.y = y0 + std::sin(turn) * a + std::cos(turn) * b;
        l.grey += 2 * rng.normal();
        drop(l);
      }
  }

 private:
  int w_, h_;
  std::vector<float> v_;
};

void drop_leaves(Canvas& canvas, const Style& style, Rng& rng) {
  const double a = 2 * style.smallest_px, b = 2 * style.largest_px;
  const double mean_area = 2 * std::numbers::pi * a * a * std::log(b / a);
  const double layers = rng.uniform(0.7, 2.5);  // how often the canvas is covered
  const int count = std::min(30000, static_cast<int>(layers * canvas.width() * canvas.height() / mean_area) + 20);
  for (int k = 0; k < count; ++k) {
    const double upper = style.large_first ? a + (b - a) * std::exp(-3.0 * k / count) : b;
    const double r = random_radius(a, std::max(upper, 1.5 * a), rng);
    const Leaf leaf = random_leaf(canvas.width(), canvas.height(), r, style, rng);
    if (r < 60 && rng.uniform() < style.repeats) canvas.drop_in_rows(leaf, rng);
    else canvas.drop(leaf);
  }
}

/// Fine structure over the whole picture, of varying strength: foliage, plaster, water.
void add_grain(Canvas& canvas, Rng& rng) {
  const double strength = 110 * rng.uniform() * rng.uniform(), period = std::exp(rng.uniform(std::log(6.0), std::log(60.0)));
  const double fall = rng.uniform(0.5, 0.9), where = rng.uniform(60, 400);
  const std::uint32_t key = rng.next_u32();
  for (int y = 0; y < canvas.height(); ++y)
    for (int x = 0; x < canvas.width(); ++x) {
      const double here = std::max(0.0, 2 * value_noise(x / where, y / where, key + 9) - 0.5);
      if (here * strength < 1) continue;
      double sum = 0, weight = 1, scale = 1 / period;
      for (int octave = 0; octave < 5 && scale < 0.7; ++octave, weight *= fall, scale *= 2)
        sum += weight * (value_noise(x * scale, y * scale, key + static_cast<std::uint32_t>(octave)) - 0.5);
      canvas.at(x, y) += static_cast<float>(2 * strength * here * sum);
    }
}

}  // namespace

Image dead_leaves(int width, int height, Rng& rng) {
  const Style style = random_style(rng);
  Canvas canvas(width, height, rng.uniform(30, 220));
  drop_leaves(canvas, style, rng);
  add_grain(canvas, rng);
  const float contrast = static_cast<float>(rng.uniform(0.25, 1.1)), grey = static_cast<float>(rng.uniform(80, 170));
  Image out(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float mean = (canvas.at(2 * x, 2 * y) + canvas.at(2 * x + 1, 2 * y) + canvas.at(2 * x, 2 * y + 1) +
                          canvas.at(2 * x + 1, 2 * y + 1)) /
                         4;
      out.at(x, y) = static_cast<std::uint8_t>(std::clamp(grey + contrast * (mean - 128) + 0.5f, 0.0f, 255.0f));
    }
  Damage lens;
  lens.defocus_px = rng.uniform(0, 1);
  lens.photons = 1e5, lens.read_noise = 0.3;
  return damage(out.view(), lens, rng);
}

}  // namespace fbvins
