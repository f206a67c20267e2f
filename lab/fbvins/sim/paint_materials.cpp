// SPDX-License-Identifier: Apache-2.0
// Textures of materials.
#include <array>
#include <numbers>

#include "fbvins/sim/brush.hpp"
#include "fbvins/sim/painters.hpp"

namespace fbvins::painters {

using namespace brush;

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
  const float base = between(rng, 0.3, 0.6), contrast = between(rng, 0.05, 0.1);
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
  shade(canvas, [&](int x, int y, float) { return base * (1 + 0.7f * noise(static_cast<float>(x), static_cast<float>(y))); });
  stains(canvas, rng, 25, 0.35f);
  scratches(canvas, rng, 30, 0.4f);
  for (int i = 0; i < 120; ++i)
    disc(canvas, {between(rng, 0, S), between(rng, 0, S), between(rng, 1, 3), between(rng, 1, 3), base * between(rng, 0.3, 1.3)});
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
    disc(canvas, {x, y, 1.6f * r, r, base * 0.5f});
    disc(canvas, {x, y, 0.8f * r, 0.5f * r, base * 0.3f});
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
    return base * stripe * (1 + 0.6f * noise(static_cast<float>(x), static_cast<float>(y)));
  });
  stains(canvas, rng, 15, 0.3f);
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
      text_line(canvas, rng, {x + 8, line, x + w - 6, pick(rng, 8, 18), 0.08f});
  }
  text_line(canvas, rng, {20, pick(rng, 420, 450), 480, pick(rng, 20, 50), base * 0.3f});
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
        disc(canvas,
             {static_cast<float>(x + (r & 1 ? w - 16 : 18)), static_cast<float>(y + (r & 2 ? w - 16 : 18)), 5, 5, base * 1.6f});
      if (rng.uniform() < 0.6)
        for (int slot = 0; slot < 7; ++slot)
          fill(canvas, x + w / 4, y + w / 3 + slot * 12, x + 3 * w / 4, y + w / 3 + slot * 12 + 5, base * 0.2f);
    }
  scratches(canvas, rng, 40, 0.5f);
  stains(canvas, rng, 12, 0.4f);
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

}  // namespace fbvins::painters
