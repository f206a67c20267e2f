// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/paint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

constexpr int S = kTextureSize;

/// Smoothed random values on a lattice of `cells` a side that wraps around; mean 0, within [-1, 1].
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

/// Noise of several scales, each half as large and `gain` as strong as the one before.
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

float between(Rng& rng, double lo, double hi) { return static_cast<float>(rng.uniform(lo, hi)); }
int pick(Rng& rng, int lo, int hi) { return lo + static_cast<int>(rng.below(static_cast<std::uint32_t>(hi - lo + 1))); }

template <class F>
void shade(Canvas& canvas, F value) {
  for (int y = 0; y < S; ++y)
    for (int x = 0; x < S; ++x) canvas.at(x, y) = std::clamp(value(x, y, canvas.at(x, y)), 0.0f, 1.0f);
}

void fill(Canvas& canvas, int x0, int y0, int x1, int y1, float value) {
  for (int y = std::max(0, y0); y < std::min(S, y1); ++y)
    for (int x = std::max(0, x0); x < std::min(S, x1); ++x) canvas.at(x, y) = value;
}

void disc(Canvas& canvas, float cx, float cy, float rx, float ry, float value) {
  for (int y = std::max(0, static_cast<int>(cy - ry)); y < std::min(S, static_cast<int>(cy + ry) + 1); ++y)
    for (int x = std::max(0, static_cast<int>(cx - rx)); x < std::min(S, static_cast<int>(cx + rx) + 1); ++x) {
      const float u = (static_cast<float>(x) - cx) / rx, v = (static_cast<float>(y) - cy) / ry;
      if (u * u + v * v < 1) canvas.at(x, y) = value;
    }
}

/// A made-up letter: strokes of a 4 x 6 grid.
void glyph(Canvas& canvas, Rng& rng, int x, int y, int height, float ink) {
  const int w = std::max(1, height / 2), stroke = std::max(1, height / 7);
  const std::uint32_t strokes = rng.next_u32() | 1u << rng.below(6);
  const auto bar = [&](int i, int x0, int y0, int x1, int y1) {
    if (strokes >> i & 1u) fill(canvas, x + x0, y + y0, x + x1, y + y1, ink);
  };
  bar(0, 0, 0, stroke, height);
  bar(1, w - stroke, 0, w, height / 2 + stroke);
  bar(2, w - stroke, height / 2, w, height);
  bar(3, 0, 0, w, stroke);
  bar(4, 0, height / 2, w, height / 2 + stroke);
  bar(5, 0, height - stroke, w, height);
}

void text_line(Canvas& canvas, Rng& rng, int x, int y, int x_end, int height, float ink) {
  while (x + height / 2 < x_end) {
    if (rng.uniform() < 0.83) glyph(canvas, rng, x, y, height, ink);
    x += height / 2 + std::max(1, height / 5);
  }
}

/// Grain on everything, so that no surface is perfectly flat.
void grain(Canvas& canvas, Rng& rng, float strength) {
  const LatticeNoise fine(rng, 256, 256), coarse(rng, 24, 24);
  shade(canvas, [&](int x, int y, float v) {
    const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
    return v * (1 + strength * (0.6f * fine(fx, fy) + 0.6f * coarse(fx, fy)));
  });
}

void scratches(Canvas& canvas, Rng& rng, int count, float contrast) {
  for (int i = 0; i < count; ++i) {
    float x = between(rng, 0, S), y = between(rng, 0, S), a = between(rng, 0, 6.28);
    const float bend = between(rng, -0.02, 0.02), change = 1 + contrast * between(rng, -1, 1);
    for (int k = pick(rng, 20, 160); k > 0; --k) {
      x += std::cos(a);
      y += std::sin(a);
      a += bend;
      float& v = canvas.at(static_cast<int>(x) & (S - 1), static_cast<int>(y) & (S - 1));
      v = std::clamp(v * change, 0.0f, 1.0f);
    }
  }
}

void stains(Canvas& canvas, Rng& rng, int count, float contrast) {
  for (int i = 0; i < count; ++i) {
    const float cx = between(rng, 0, S), cy = between(rng, 0, S), r = between(rng, 3, 28);
    const float change = 1 + contrast * between(rng, -1, 0.6);
    const LatticeNoise edge(rng, 40, 40);
    for (int y = static_cast<int>(cy - 2 * r); y < static_cast<int>(cy + 2 * r); ++y)
      for (int x = static_cast<int>(cx - 2 * r); x < static_cast<int>(cx + 2 * r); ++x) {
        const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
        if (std::hypot(fx - cx, fy - cy) > r * (1 + 0.5f * edge(fx, fy))) continue;
        float& v = canvas.at(x & (S - 1), y & (S - 1));
        v = std::clamp(v * change, 0.0f, 1.0f);
      }
  }
}

Canvas plaster(Rng& rng) {
  Canvas canvas;
  const Fractal noise(rng, 4, 6, 0.7f);
  const float base = between(rng, 0.5, 0.8), contrast = between(rng, 0.012, 0.04);
  shade(canvas,
        [&](int x, int y, float) { return base * (1 + contrast * 2 * noise(static_cast<float>(x), static_cast<float>(y))); });
  scratches(canvas, rng, 6, 0.1f);
  return canvas;
}

Canvas weave(Rng& rng) {
  Canvas canvas;
  const Fractal folds(rng, 3, 4, 0.5f);
  const LatticeNoise uneven(rng, 128, 128);
  const float base = between(rng, 0.3, 0.6), contrast = between(rng, 0.06, 0.14);
  const int threads = 1 << pick(rng, 5, 6);
  const float step = 2 * std::numbers::pi_v<float> * static_cast<float>(threads) / S;
  shade(canvas, [&](int x, int y, float) {
    const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
    return base * (1 + contrast * std::sin(step * fx) * std::sin(step * fy) + 0.12f * folds(fx, fy) + 0.02f * uneven(fx, fy));
  });
  return canvas;
}

Canvas concrete(Rng& rng) {
  Canvas canvas;
  const Fractal noise(rng, 3, 7, 0.75f);
  const float base = between(rng, 0.3, 0.55);
  shade(canvas, [&](int x, int y, float) { return base * (1 + 0.9f * noise(static_cast<float>(x), static_cast<float>(y))); });
  stains(canvas, rng, 25, 0.35f);
  scratches(canvas, rng, 30, 0.4f);
  for (int i = 0; i < 120; ++i)
    disc(canvas, between(rng, 0, S), between(rng, 0, S), between(rng, 1, 3), between(rng, 1, 3), base * between(rng, 0.3, 1.3));
  return canvas;
}

Canvas wood(Rng& rng) {
  Canvas canvas;
  const int planks = pick(rng, 3, 6);
  const float base = between(rng, 0.25, 0.6);
  const LatticeNoise wave(rng, 2, 12), fibre(rng, 8, 256), colour(rng, 4, 64);
  std::array<float, 8> tone{}, shift{};
  for (int i = 0; i < 8; ++i) tone[i] = between(rng, 0.75, 1.2), shift[i] = between(rng, 0, S);
  shade(canvas, [&](int x, int y, float) {
    const int plank = y * planks / S;
    const float fx = static_cast<float>(x) + shift[plank], fy = static_cast<float>(y);
    const float ring = std::sin(fy * 0.25f + 9 * wave(fx, fy));
    const float v = base * tone[plank] * (1 + 0.06f * ring + 0.16f * fibre(fx, fy) + 0.15f * colour(fx, fy));
    const bool gap = (y * planks) % S < 2 * planks || (x + static_cast<int>(shift[plank])) % S < 2;
    return gap ? 0.3f * v : v;
  });
  for (int i = 0; i < 6; ++i) {
    const float x = between(rng, 0, S), y = between(rng, 0, S), r = between(rng, 3, 8);
    disc(canvas, x, y, 1.6f * r, r, base * 0.5f);
    disc(canvas, x, y, 0.8f * r, 0.5f * r, base * 0.3f);
  }
  return canvas;
}

Canvas brick(Rng& rng) {
  Canvas canvas;
  const int rows = 2 * pick(rng, 4, 6), columns = rows / 2;
  const float base = between(rng, 0.25, 0.5), mortar = between(rng, 0.45, 0.7);
  const Fractal noise(rng, 8, 5, 0.8f);
  std::vector<float> tone(static_cast<std::size_t>(rows) * columns);
  for (float& t : tone) t = between(rng, 0.65, 1.35);
  shade(canvas, [&](int x, int y, float) {
    const int row = y * rows / S, shifted = (x + (row & 1) * S / (2 * columns)) & (S - 1), column = shifted * columns / S;
    const int in_x = shifted - column * S / columns, in_y = y - row * S / rows;
    const float rough = 1 + 0.5f * noise(static_cast<float>(x), static_cast<float>(y));
    return in_x < 5 || in_y < 5 ? mortar * rough : base * tone[static_cast<std::size_t>(row * columns + column)] * rough;
  });
  return canvas;
}

Canvas tiles(Rng& rng) {
  Canvas canvas;
  const int n = pick(rng, 2, 5);
  const float base = between(rng, 0.4, 0.65), other = rng.uniform() < 0.4 ? base * between(rng, 0.4, 0.8) : base;
  const Fractal noise(rng, 6, 6, 0.7f);
  std::vector<float> tone(static_cast<std::size_t>(n) * n);
  for (float& t : tone) t = between(rng, 0.9, 1.08);
  shade(canvas, [&](int x, int y, float) {
    const int cx = x * n / S, cy = y * n / S;
    const float rough = 1 + 0.35f * noise(static_cast<float>(x), static_cast<float>(y));
    if (x - cx * S / n < 4 || y - cy * S / n < 4) return 0.25f * rough;
    return ((cx + cy) & 1 ? other : base) * tone[static_cast<std::size_t>(cy * n + cx)] * rough;
  });
  stains(canvas, rng, 10, 0.25f);
  return canvas;
}

Canvas carpet(Rng& rng) {
  Canvas canvas;
  const Fractal noise(rng, 16, 6, 0.95f);
  const float base = between(rng, 0.2, 0.45);
  const int stripes = pick(rng, 0, 6);
  shade(canvas, [&](int x, int y, float) {
    const float stripe = stripes && ((x * stripes / S) & 1) ? 0.75f : 1.0f;
    return base * stripe * (1 + 1.1f * noise(static_cast<float>(x), static_cast<float>(y)));
  });
  stains(canvas, rng, 15, 0.3f);
  return canvas;
}

Canvas page(Rng& rng) {
  Canvas canvas;
  const float paper = between(rng, 0.7, 0.95), ink = between(rng, 0.03, 0.2);
  fill(canvas, 0, 0, S, S, paper);
  int y = pick(rng, 14, 30);
  text_line(canvas, rng, 30, y, pick(rng, 250, 480), pick(rng, 26, 44), ink);
  y += 60;
  const int columns = pick(rng, 1, 2);
  while (y < S - 30) {
    const int height = pick(rng, 7, 13);
    for (int lines = pick(rng, 3, 9); lines > 0 && y < S - 20; --lines, y += height + 5)
      for (int c = 0; c < columns; ++c)
        text_line(canvas, rng, 28 + c * 240, y, columns == 1 ? pick(rng, 380, 484) : 250 + c * 240, height, ink);
    if (rng.uniform() < 0.5) {
      const int tall = pick(rng, 40, 110), x0 = pick(rng, 28, 200), x1 = x0 + pick(rng, 80, 260);
      fill(canvas, x0, y, x1, std::min(S - 12, y + tall), between(rng, 0.2, 0.7));
      for (int i = 0; i < 12; ++i)
        disc(canvas, between(rng, x0, x1), between(rng, y, std::min(S - 20, y + tall)), between(rng, 3, 25), between(rng, 3, 18),
             between(rng, 0.05, 0.9));
      y += tall + 14;
    }
    y += 12;
  }
  grain(canvas, rng, 0.06f);
  return canvas;
}

Canvas poster(Rng& rng) {
  Canvas canvas;
  const LatticeNoise back(rng, 3, 3);
  const float base = between(rng, 0.25, 0.85);
  shade(canvas, [&](int x, int y, float) { return base + 0.25f * back(static_cast<float>(x), static_cast<float>(y)); });
  for (int i = pick(rng, 12, 40); i > 0; --i) {
    const float v = between(rng, 0.03, 0.95), x = between(rng, 0, S), y = between(rng, 0, S);
    const float a = between(rng, 4, 90), b = between(rng, 4, 90);
    if (rng.uniform() < 0.5) disc(canvas, x, y, a, b, v);
    else fill(canvas, static_cast<int>(x - a), static_cast<int>(y - b), static_cast<int>(x + a), static_cast<int>(y + b), v);
  }
  for (int i = pick(rng, 2, 6); i > 0; --i) {
    const int height = pick(rng, 12, 80), y = pick(rng, 5, S - 90);
    text_line(canvas, rng, pick(rng, 10, 150), y, pick(rng, 260, 500), height, rng.uniform() < 0.5 ? 0.05f : 0.95f);
  }
  fill(canvas, 0, 0, S, 8, 0.9f);
  fill(canvas, 0, S - 8, S, S, 0.9f);
  fill(canvas, 0, 0, 8, S, 0.9f);
  fill(canvas, S - 8, 0, S, S, 0.9f);
  grain(canvas, rng, 0.1f);
  return canvas;
}

/// Overlapping regions of different tone whose outlines are rough, with texture inside: edges and
/// corners at every scale, as in a photograph.
Canvas picture(Rng& rng) {
  Canvas canvas;
  const Fractal base(rng, 2, 7, 0.6f);
  shade(canvas, [&](int x, int y, float) { return 0.45f + 0.5f * base(static_cast<float>(x), static_cast<float>(y)); });
  const int regions = pick(rng, 10, 18);
  for (int i = 0; i < regions; ++i) {
    const Fractal outline(rng, pick(rng, 2, 9), 5, 0.6f), inside(rng, pick(rng, 6, 40), 4, 0.85f);
    const float level = between(rng, 0.15, 0.5), tone = between(rng, 0.05, 0.9), rough = between(rng, 0.1, 0.7);
    const float cx = between(rng, 0, S), cy = between(rng, 0, S), radius = between(rng, 40, 220);
    shade(canvas, [&](int x, int y, float v) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float d2 = ((fx - cx) * (fx - cx) + (fy - cy) * (fy - cy)) / (radius * radius);
      if (d2 > 1.5f || outline(fx, fy) + 0.6f * (1 - d2) < level) return v;
      return tone * (1 + rough * inside(fx, fy));
    });
  }
  return canvas;
}

Canvas cardboard(Rng& rng) {
  Canvas canvas;
  const Fractal noise(rng, 4, 6, 0.8f);
  const float base = between(rng, 0.35, 0.6);
  shade(canvas, [&](int x, int y, float) { return base * (1 + 0.2f * noise(static_cast<float>(x), static_cast<float>(y))); });
  const int tape = pick(rng, 30, 60), at = pick(rng, 150, 300);
  fill(canvas, at, 0, at + tape, S, base * between(rng, 1.15, 1.5));
  for (int i = pick(rng, 1, 4); i > 0; --i) {
    const int x = pick(rng, 10, 330), y = pick(rng, 10, 380), w = pick(rng, 80, 170), h = pick(rng, 50, 120);
    fill(canvas, x, y, x + w, y + h, 0.9f);
    for (int line = y + 8; line + 12 < y + h; line += pick(rng, 14, 26))
      text_line(canvas, rng, x + 8, line, x + w - 6, pick(rng, 8, 18), 0.08f);
  }
  text_line(canvas, rng, 20, pick(rng, 420, 450), 480, pick(rng, 20, 50), base * 0.3f);
  scratches(canvas, rng, 25, 0.3f);
  fill(canvas, 0, 0, S, 3, base * 0.5f);
  fill(canvas, 0, 0, 3, S, base * 0.5f);
  return canvas;
}

Canvas metal(Rng& rng) {
  Canvas canvas;
  const LatticeNoise brushed(rng, 4, 256), wide(rng, 3, 6);
  const float base = between(rng, 0.2, 0.6);
  shade(canvas, [&](int x, int y, float) {
    return base * (1 + 0.12f * brushed(static_cast<float>(x), static_cast<float>(y)) +
                   0.3f * wide(static_cast<float>(x), static_cast<float>(y)));
  });
  const int n = pick(rng, 1, 3);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int x = i * S / n, y = j * S / n, w = S / n;
      fill(canvas, x, y, x + w, y + 4, base * 0.3f);
      fill(canvas, x, y, x + 4, y + w, base * 0.3f);
      for (int r = 0; r < 4; ++r)
        disc(canvas, static_cast<float>(x + (r & 1 ? w - 16 : 18)), static_cast<float>(y + (r & 2 ? w - 16 : 18)), 5, 5,
             base * 1.6f);
      if (rng.uniform() < 0.6)
        for (int slot = 0; slot < 7; ++slot)
          fill(canvas, x + w / 4, y + w / 3 + slot * 12, x + 3 * w / 4, y + w / 3 + slot * 12 + 5, base * 0.2f);
    }
  scratches(canvas, rng, 40, 0.5f);
  stains(canvas, rng, 12, 0.4f);
  return canvas;
}

Canvas books(Rng& rng) {
  Canvas canvas;
  fill(canvas, 0, 0, S, S, 0.08f);
  for (int shelf = 0; shelf < 3; ++shelf) {
    const int bottom = (shelf + 1) * S / 3 - 12;
    fill(canvas, 0, bottom, S, bottom + 12, 0.5f);
    for (int x = 2; x < S - 10;) {
      const int w = pick(rng, 9, 34), h = pick(rng, 90, 145);
      const float tone = between(rng, 0.08, 0.9);
      if (rng.uniform() < 0.9) {
        fill(canvas, x, bottom - h, x + w - 1, bottom, tone);
        const float ink = tone > 0.5f ? 0.1f : 0.9f;
        for (int y = bottom - h + pick(rng, 8, 30), k = pick(rng, 2, 8); k > 0 && y < bottom - 14; --k, y += pick(rng, 9, 16))
          glyph(canvas, rng, x + w / 4, y, std::max(6, w / 2), ink);
      }
      x += w;
    }
  }
  grain(canvas, rng, 0.12f);
  return canvas;
}

Canvas cloth(Rng& rng) {
  Canvas canvas;
  const Fractal folds(rng, 3, 3, 0.5f);
  const LatticeNoise weave(rng, 256, 256);
  const float base = between(rng, 0.2, 0.7), contrast = between(rng, 0.1, 0.6);
  const int a = pick(rng, 4, 20), b = pick(rng, 4, 20);
  shade(canvas, [&](int x, int y, float) {
    const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
    const float plaid = ((x * a / S) & 1 ? contrast : 0) + ((y * b / S) & 1 ? 0.7f * contrast : 0);
    return base * (1 - 0.5f * plaid) * (1 + 0.5f * folds(fx, fy) + 0.25f * weave(fx, fy));
  });
  return canvas;
}

Canvas panel(Rng& rng) {
  Canvas canvas;
  const float base = between(rng, 0.15, 0.6);
  fill(canvas, 0, 0, S, S, base);
  grain(canvas, rng, 0.15f);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const int x = i * S / 6 + pick(rng, 4, 16), y = j * S / 6 + pick(rng, 4, 16);
      const double what = rng.uniform();
      const float tone = rng.uniform() < 0.5 ? base * 0.3f : std::min(1.0f, base + 0.4f);
      if (what < 0.3) {
        const float r = between(rng, 8, 28);
        disc(canvas, static_cast<float>(x) + 30, static_cast<float>(y) + 30, r, r, tone);
        disc(canvas, static_cast<float>(x) + 30, static_cast<float>(y) + 30, 0.6f * r, 0.6f * r, 1 - tone);
      } else if (what < 0.6) {
        const int w = pick(rng, 20, 60), h = pick(rng, 10, 60);
        fill(canvas, x, y, x + w, y + h, tone);
        fill(canvas, x + 4, y + 4, x + w - 4, y + h - 4, 0.8f * tone + 0.05f);
        text_line(canvas, rng, x, y + h + 4, x + w, 10, 0.95f - tone);
      } else if (what < 0.85) {
        for (int k = 0; k < 4; ++k) text_line(canvas, rng, x, y + 14 * k, x + pick(rng, 30, 70), 9, 1 - base);
      }
    }
  scratches(canvas, rng, 25, 0.4f);
  return canvas;
}

Canvas marks(Rng& rng) {
  Canvas canvas;
  fill(canvas, 0, 0, S, S, between(rng, 0.03, 0.1));
  for (int i = 0; i < 90; ++i) {
    const float cx = between(rng, 0, S), cy = between(rng, 0, S), a = between(rng, 0, 6.28), w = between(rng, 8, 26),
                h = between(rng, 6, 16);
    const float tone = between(rng, 0.7, 0.95), c = std::cos(a), s = std::sin(a);
    for (int y = static_cast<int>(cy - 30); y < static_cast<int>(cy + 30); ++y)
      for (int x = static_cast<int>(cx - 30); x < static_cast<int>(cx + 30); ++x) {
        const float dx = static_cast<float>(x) - cx, dy = static_cast<float>(y) - cy;
        if (std::abs(c * dx + s * dy) < w && std::abs(c * dy - s * dx) < h) canvas.at(x & (S - 1), y & (S - 1)) = tone;
      }
  }
  return canvas;
}

Canvas checker(Rng& rng) {
  Canvas canvas;
  const int n = pick(rng, 6, 9);
  const float dark = between(rng, 0.03, 0.1), light = between(rng, 0.8, 0.95);
  shade(canvas, [&](int x, int y, float) { return ((x * n / S + y * n / S) & 1) ? dark : light; });
  fill(canvas, 0, 0, S, 12, light);
  fill(canvas, 0, S - 12, S, S, light);
  return canvas;
}

Canvas mat(Rng& rng) {
  Canvas canvas;
  const LatticeNoise country(rng, 4, 4), fine(rng, 64, 64);
  const float base = between(rng, 0.4, 0.7);
  shade(canvas, [&](int x, int y, float) {
    const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
    return (country(fx, fy) > 0.2f ? base * 0.75f : base) * (1 + 0.05f * fine(fx, fy));
  });
  for (int i = pick(rng, 3, 6); i > 0; --i) {  // roads with a dashed line
    float x = between(rng, 0, S), y = between(rng, 0, S), a = between(rng, 0, 6.28), bend = 0;
    for (int k = 0; k < 520; ++k) {
      if (k % 40 == 0) bend = between(rng, -0.03, 0.03);
      a += bend;
      x += std::cos(a);
      y += std::sin(a);
      for (int o = -17; o <= 17; ++o) {
        const float edge = std::abs(o) > 14 ? 0.9f : std::abs(o) < 2 && k % 24 < 12 ? 0.92f : 0.2f;
        canvas.at(static_cast<int>(x - static_cast<float>(o) * std::sin(a)) & (S - 1),
                  static_cast<int>(y + static_cast<float>(o) * std::cos(a)) & (S - 1)) = edge;
      }
    }
  }
  for (int i = pick(rng, 25, 45); i > 0; --i) {
    const int x = pick(rng, 0, S - 30), y = pick(rng, 0, S - 30), w = pick(rng, 8, 46), h = pick(rng, 8, 46);
    const float tone = between(rng, 0.1, 0.9);
    fill(canvas, x, y, x + w, y + h, 0.1f);
    fill(canvas, x + 2, y + 2, x + w - 2, y + h - 2, tone);
    for (int wx = x + 5; wx + 5 < x + w; wx += 9)
      for (int wy = y + 5; wy + 5 < y + h; wy += 9) fill(canvas, wx, wy, wx + 4, wy + 5, 1 - tone);
  }
  return canvas;
}

}  // namespace

Canvas paint(Surface surface, Rng& rng) {
  switch (surface) {
    case Surface::plaster: return plaster(rng);
    case Surface::weave: return weave(rng);
    case Surface::concrete: return concrete(rng);
    case Surface::wood: return wood(rng);
    case Surface::brick: return brick(rng);
    case Surface::tiles: return tiles(rng);
    case Surface::carpet: return carpet(rng);
    case Surface::page: return page(rng);
    case Surface::poster: return poster(rng);
    case Surface::picture: return picture(rng);
    case Surface::cardboard: return cardboard(rng);
    case Surface::metal: return metal(rng);
    case Surface::books: return books(rng);
    case Surface::cloth: return cloth(rng);
    case Surface::panel: return panel(rng);
    case Surface::marks: return marks(rng);
    case Surface::checker: return checker(rng);
    case Surface::mat: return mat(rng);
    case Surface::count: break;
  }
  return Canvas{};
}

}  // namespace fbvins
