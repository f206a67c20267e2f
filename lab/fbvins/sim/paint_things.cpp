// SPDX-License-Identifier: Apache-2.0
// Textures of things: prints, pictures, shelves, panels.
#include "fbvins/sim/brush.hpp"
#include "fbvins/sim/painters.hpp"

namespace fbvins::painters {

using namespace brush;

Canvas page(Rng& rng) {
  Canvas canvas;
  const float paper = between(rng, 0.7, 0.95), ink = between(rng, 0.03, 0.2);
  fill(canvas, 0, 0, S, S, paper);
  int y = pick(rng, 14, 30);
  text_line(canvas, rng, {30, y, pick(rng, 250, 480), pick(rng, 26, 44), ink});
  y += 60;
  const int columns = pick(rng, 1, 2);
  while (y < S - 30) {
    const int height = pick(rng, 7, 13);
    for (int lines = pick(rng, 3, 9); lines > 0 && y < S - 20; --lines, y += height + 5)
      for (int c = 0; c < columns; ++c)
        text_line(canvas, rng, {28 + c * 240, y, columns == 1 ? pick(rng, 380, 484) : 250 + c * 240, height, ink});
    if (rng.uniform() < 0.5) {
      const int tall = pick(rng, 40, 110), x0 = pick(rng, 28, 200), x1 = x0 + pick(rng, 80, 260);
      fill(canvas, x0, y, x1, std::min(S - 12, y + tall), between(rng, 0.2, 0.7));
      for (int i = 0; i < 12; ++i)
        disc(canvas, {between(rng, x0, x1), between(rng, y, std::min(S - 20, y + tall)), between(rng, 3, 25), between(rng, 3, 18),
                      between(rng, 0.05, 0.9)});
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
    if (rng.uniform() < 0.5) disc(canvas, {x, y, a, b, v});
    else fill(canvas, static_cast<int>(x - a), static_cast<int>(y - b), static_cast<int>(x + a), static_cast<int>(y + b), v);
  }
  for (int i = pick(rng, 2, 6); i > 0; --i) {
    const int height = pick(rng, 12, 80), y = pick(rng, 5, S - 90);
    text_line(canvas, rng, {pick(rng, 10, 150), y, pick(rng, 260, 500), height, rng.uniform() < 0.5 ? 0.05f : 0.95f});
  }
  fill(canvas, 0, 0, S, 8, 0.9f);
  fill(canvas, 0, S - 8, S, S, 0.9f);
  fill(canvas, 0, 0, 8, S, 0.9f);
  fill(canvas, S - 8, 0, S, S, 0.9f);
  grain(canvas, rng, 0.1f);
  return canvas;
}

/// Overlapping textured regions of different tone with rough outlines: edges and corners at every scale, as in a
/// photograph.
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
        disc(canvas, {static_cast<float>(x) + 30, static_cast<float>(y) + 30, r, r, tone});
        disc(canvas, {static_cast<float>(x) + 30, static_cast<float>(y) + 30, 0.6f * r, 0.6f * r, 1 - tone});
      } else if (what < 0.6) {
        const int w = pick(rng, 20, 60), h = pick(rng, 10, 60);
        fill(canvas, x, y, x + w, y + h, tone);
        fill(canvas, x + 4, y + 4, x + w - 4, y + h - 4, 0.8f * tone + 0.05f);
        text_line(canvas, rng, {x, y + h + 4, x + w, 10, 0.95f - tone});
      } else if (what < 0.85) {
        for (int k = 0; k < 4; ++k) text_line(canvas, rng, {x, y + 14 * k, x + pick(rng, 30, 70), 9, 1 - base});
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

}  // namespace fbvins::painters
