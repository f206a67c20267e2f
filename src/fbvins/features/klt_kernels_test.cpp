// SPDX-License-Identifier: Apache-2.0
// The kernels of Lucas-Kanade alignment give the bits of plain loops, in which each column is summed on its own and the sums of
// columns are added pairwise.
#include "fbvins/features/klt_kernels.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace klt_kernels_test {

constexpr int kP = kKltPatch, kSide = 48;

struct Numbers {
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(kSide * kSide + 64);
  std::array<float, kP * kP> a, b, c;
  float fx, fy;
  explicit Numbers(std::uint64_t seed) {
    Rng rng(seed);
    for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(rng.uniform(0, 256));
    for (auto* field : {&a, &b, &c})
      for (float& x : *field) x = static_cast<float>(rng.uniform(-1, 1));
    fx = static_cast<float>(rng.uniform(0, 1)), fy = static_cast<float>(rng.uniform(0, 1));
  }
  [[nodiscard]] float pixel(int x, int y) const { return pixels[static_cast<std::size_t>(y * kSide + x)]; }
  [[nodiscard]] float sample(int x, int y) const {
    const float upper = pixel(x, y) + (pixel(x + 1, y) - pixel(x, y)) * fx;
    const float lower = pixel(x, y + 1) + (pixel(x + 1, y + 1) - pixel(x, y + 1)) * fx;
    return upper + (lower - upper) * fy;
  }
};

using At = std::function<float(int x, int y)>;

float sum_over_patch(const At& term) {
  std::array<float, kP> column{};
  for (int y = 0; y < kP; ++y)
    for (int x = 0; x < kP; ++x) column[static_cast<std::size_t>(x)] += term(x, y);
  for (std::size_t half = kP / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i) column[i] += column[i + half];
  return column[0];
}

At at(const float* values, int stride = kP) {
  return [=](int x, int y) { return values[y * stride + x]; };
}
At product(const At& f, const At& g) {
  return [=](int x, int y) { return f(x, y) * g(x, y); };
}

void expect_same_bits(float found, float wanted) {
  EXPECT_EQ(std::bit_cast<std::uint32_t>(found), std::bit_cast<std::uint32_t>(wanted));
}

TEST(KltKernels, SumsOverAPatch) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Numbers n(seed);
    const At sample = [&](int x, int y) { return n.sample(x, y); }, pixel = [&](int x, int y) { return n.pixel(x, y); };
    klt::Projections sums;
    klt::project_patch(n.pixels.data(), kSide, n.fx, n.fy, n.a.data(), n.b.data(), n.c.data(), sums);
    expect_same_bits(sums.gx, sum_over_patch(product(at(n.a.data()), sample)));
    expect_same_bits(sums.gy, sum_over_patch(product(at(n.b.data()), sample)));
    expect_same_bits(sums.t, sum_over_patch(product(at(n.c.data()), sample)));
    for (const bool between : {true, false}) {
      const At value = between ? sample : pixel;
      klt::PatchMoments m;
      if (between) klt::patch_moments(n.pixels.data(), kSide, n.fx, n.fy, n.a.data(), n.b.data(), m);
      else klt::pixel_moments(n.pixels.data(), kSide, n.a.data(), n.b.data(), m);
      expect_same_bits(m.t, sum_over_patch(product(at(n.a.data()), value)));
      expect_same_bits(m.one, sum_over_patch(product(at(n.b.data()), value)));
      expect_same_bits(m.square, sum_over_patch(product(product(at(n.b.data()), value), value)));
    }
  }
}

TEST(KltKernels, SamplesOfAGrid) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Numbers n(seed);
    std::array<float, klt::kGrid * klt::kGridStride> grid;
    klt::sample_grid(n.pixels.data(), kSide, n.fx, n.fy, grid.data());
    for (int y = 0; y < klt::kGrid; ++y)
      for (int x = 0; x < klt::kGrid; ++x) expect_same_bits(at(grid.data(), klt::kGridStride)(x, y), n.sample(x, y));
    const float u0 = 5 + n.fx, v0 = 6 + n.fy, ux = 1 + 0.2f * n.a[0], uy = 0.2f * n.a[1], vx = 0.2f * n.a[2],
                vy = 1 + 0.2f * n.a[3];
    klt::sample_warped(n.pixels.data(), kSide, u0, v0, ux, uy, vx, vy, grid.data());
    for (int y = 0; y < klt::kGrid; ++y)
      for (int x = 0; x < klt::kGrid; ++x) {
        const float u = u0 + static_cast<float>(x) * ux + static_cast<float>(y) * uy;
        const float v = v0 + static_cast<float>(x) * vx + static_cast<float>(y) * vy;
        Numbers there = n;
        there.fx = u - std::floor(u), there.fy = v - std::floor(v);
        expect_same_bits(at(grid.data(), klt::kGridStride)(x, y), there.sample(static_cast<int>(u), static_cast<int>(v)));
      }
  }
}

TEST(KltKernels, Template) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Numbers n(seed);
    std::array<float, klt::kGrid * klt::kGridStride> grid;
    klt::sample_grid(n.pixels.data(), kSide, n.fx, n.fy, grid.data());
    std::array<float, kP * kP> t, gx, gy;
    klt::TemplateMoments m;
    klt::differentiate(grid.data(), n.a.data(), t.data(), gx.data(), gy.data(), m);
    const At g = at(grid.data(), klt::kGridStride), w = at(n.a.data());
    const At value = [&](int x, int y) { return g(x + 1, y + 1); };
    const At dx = [&](int x, int y) { return (g(x + 2, y + 1) - g(x, y + 1)) * 0.5f; };
    const At dy = [&](int x, int y) { return (g(x + 1, y + 2) - g(x + 1, y)) * 0.5f; };
    const At wv = product(w, value), wdx = product(w, dx), wdy = product(w, dy);
    const std::array<std::pair<float, At>, 9> sums = {{{m.t, wv},
                                                       {m.gx, wdx},
                                                       {m.gy, wdy},
                                                       {m.tt, product(wv, value)},
                                                       {m.tgx, product(wv, dx)},
                                                       {m.tgy, product(wv, dy)},
                                                       {m.gxx, product(wdx, dx)},
                                                       {m.gxy, product(wdx, dy)},
                                                       {m.gyy, product(wdy, dy)}}};
    for (const auto& [found, term] : sums) expect_same_bits(found, sum_over_patch(term));
    const auto before = std::array{t, gx, gy};
    klt::orthogonalise(n.a.data(), 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, t.data(), gx.data(), gy.data());
    for (int y = 0; y < kP; ++y)
      for (int x = 0; x < kP; ++x) {
        const auto i = static_cast<std::size_t>(y * kP + x);
        expect_same_bits(before[0][i], value(x, y));
        expect_same_bits(before[1][i], dx(x, y));
        expect_same_bits(before[2][i], dy(x, y));
        const float from_mean = before[0][i] - 0.1f;
        expect_same_bits(t[i], from_mean * n.a[i]);
        expect_same_bits(gx[i], (before[1][i] - 0.2f - from_mean * 0.4f) * n.a[i]);
        expect_same_bits(gy[i], (before[2][i] - 0.3f - from_mean * 0.5f) * n.a[i]);
      }
  }
}

}  // namespace klt_kernels_test
}  // namespace fbvins
