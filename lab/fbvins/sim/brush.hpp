// SPDX-License-Identifier: Apache-2.0
// Building blocks of procedural textures: noise, shapes, letters, wear. Private to paint*.cpp; pure functions.
//
// Random numbers are drawn in an order that the language fixes: at most one draw in the arguments of a call, several
// only inside braces (evaluated from left to right) or in statements of their own. Otherwise another compiler
// would make another world from the same seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/texture.hpp"

namespace fbvins::brush {

inline constexpr int S = kTextureSize;

/// Value noise: smoothly interpolated random values on a periodic lattice; mean 0, within [-1, 1].
class LatticeNoise {
 public:
  LatticeNoise(Rng& rng, int cells_x, int cells_y) : nx_(cells_x), ny_(cells_y) {
    values_.resize(static_cast<std::size_t>(nx_) * ny_);
    for (float& v : values_) v = static_cast<float>(rng.uniform(-1, 1));
  }
  /// x and y in texels.
  float operator()(float x, float y) const {
    const float fx = x * static_cast<float>(nx_) / S, fy = y * static_cast<float>(ny_) / S;
    const float bx = std::floor(fx), by = std::floor(fy);
    const float u = ease(fx - bx), v = ease(fy - by);
    const int ix = wrap(static_cast<int>(bx), nx_), iy = wrap(static_cast<int>(by), ny_);
    const int jx = ix + 1 == nx_ ? 0 : ix + 1, jy = iy + 1 == ny_ ? 0 : iy + 1;
    const float top = at(ix, iy) + u * (at(jx, iy) - at(ix, iy));
    const float low = at(ix, jy) + u * (at(jx, jy) - at(ix, jy));
    return top + v * (low - top);
  }

 private:
  static float ease(float t) { return t * t * (3 - 2 * t); }
  static int wrap(int i, int n) { return ((i % n) + n) % n; }
  float at(int x, int y) const { return values_[static_cast<std::size_t>(y) * nx_ + x]; }
  int nx_, ny_;
  std::vector<float> values_;
};

/// Fractal noise: octaves, each with half the scale and `gain` times the strength of the one before.
class Fractal {
 public:
  Fractal(Rng& rng, int cells, int octaves, float gain) : gain_(gain) {
    for (int o = 0; o < octaves; ++o) layers_.emplace_back(rng, std::min(S, cells << o), std::min(S, cells << o));
  }
  float operator()(float x, float y) const {
    float sum = 0, weight = 1, total = 0;
    for (const LatticeNoise& layer : layers_) {
      sum += weight * layer(x, y);
      total += weight;
      weight *= gain_;
    }
    return sum / total;
  }

 private:
  float gain_;
  std::vector<LatticeNoise> layers_;
};

inline float between(Rng& rng, double lo, double hi) { return static_cast<float>(rng.uniform(lo, hi)); }
inline int pick(Rng& rng, int lo, int hi) { return lo + static_cast<int>(rng.below(static_cast<std::uint32_t>(hi - lo + 1))); }

/// Sets every texel from its position and its old value.
template <class F>
void shade(Canvas& canvas, F value) {
  for (int y = 0; y < S; ++y)
    for (int x = 0; x < S; ++x) canvas.at(x, y) = std::clamp(value(x, y, canvas.at(x, y)), 0.0f, 1.0f);
}

/// Axis-aligned rectangle, in texels; x1 and y1 are exclusive.
struct Box {
  int x0, y0, x1, y1;
  float value;
};
void fill(Canvas& canvas, const Box& box);
inline void fill(Canvas& canvas, int x0, int y0, int x1, int y1, float value) { fill(canvas, {x0, y0, x1, y1, value}); }

/// Ellipse, in texels.
struct Disc {
  float cx, cy, rx, ry;
  float value;
};
void disc(Canvas& canvas, const Disc& disc);

/// A synthetic letter: strokes of a 4 x 6 grid.
void glyph(Canvas& canvas, Rng& rng, int x, int y, int height, float ink);

struct Line {
  int x, y, x_end, height;
  float ink;
};
void text_line(Canvas& canvas, Rng& rng, const Line& line);

/// Fine noise, so that no surface is perfectly uniform.
void grain(Canvas& canvas, Rng& rng, float strength);
void scratches(Canvas& canvas, Rng& rng, int count, float contrast);
void stains(Canvas& canvas, Rng& rng, int count, float contrast);

}  // namespace fbvins::brush
