// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/brush.hpp"

namespace fbvins::brush {

void fill(Canvas& canvas, const Box& box) {
  for (int y = std::max(0, box.y0); y < std::min(S, box.y1); ++y)
    for (int x = std::max(0, box.x0); x < std::min(S, box.x1); ++x) canvas.at(x, y) = box.value;
}

void disc(Canvas& canvas, const Disc& disc) {
  const auto [cx, cy, rx, ry, value] = disc;
  for (int y = std::max(0, static_cast<int>(cy - ry)); y < std::min(S, static_cast<int>(cy + ry) + 1); ++y)
    for (int x = std::max(0, static_cast<int>(cx - rx)); x < std::min(S, static_cast<int>(cx + rx) + 1); ++x) {
      const float u = (static_cast<float>(x) - cx) / rx, v = (static_cast<float>(y) - cy) / ry;
      if (u * u + v * v < 1) canvas.at(x, y) = value;
    }
}

void glyph(Canvas& canvas, Rng& rng, int x, int y, int height, float ink) {
  const int w = std::max(1, height / 2), stroke = std::max(1, height / 7);
  const std::uint32_t some = rng.next_u32(), at_least = 1u << rng.below(6), strokes = some | at_least;
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

void text_line(Canvas& canvas, Rng& rng, const Line& line) {
  auto [x, y, x_end, height, ink] = line;
  while (x + height / 2 < x_end) {
    if (rng.uniform() < 0.83) glyph(canvas, rng, x, y, height, ink);
    x += height / 2 + std::max(1, height / 5);
  }
}

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

}  // namespace fbvins::brush
