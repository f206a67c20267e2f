// SPDX-License-Identifier: Apache-2.0
// Harris score, orientation and bits of one keypoint.
#include <cmath>
#include <cstring>

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/orb_pattern.hpp"

namespace fbvins {
namespace {

constexpr int kDisc = 2 * kOrbRadius + 2;  // 32 columns: -15 .. 16, the last never inside

/// Half-width of each row of the disc as a mask of 0 / 0xff bytes.
struct Disc {
  std::uint8_t mask[2 * kOrbRadius + 1][kDisc] = {};
  constexpr Disc() {
    for (int y = -kOrbRadius; y <= kOrbRadius; ++y)
      for (int x = -kOrbRadius; x <= kOrbRadius; ++x)
        if (x * x + y * y <= kOrbRadius * kOrbRadius) mask[y + kOrbRadius][x + kOrbRadius] = 0xff;
  }
};
constexpr Disc kDiscMask;

FBVINS_KERNEL
void disc_moments(const std::uint8_t* corner, std::ptrdiff_t stride, std::int32_t* m10, std::int32_t* m01) {
  std::uint16_t column[kDisc] = {};  // at most 31 * 255
  std::int32_t sum_y = 0;
  for (int r = 0; r <= 2 * kOrbRadius; ++r) {
    const std::uint8_t* p = corner + r * stride;
    std::uint16_t row = 0;
    for (int c = 0; c < kDisc; ++c) {
      const std::uint16_t value = static_cast<std::uint16_t>(p[c] & kDiscMask.mask[r][c]);
      column[c] = static_cast<std::uint16_t>(column[c] + value);
      row = static_cast<std::uint16_t>(row + value);
    }
    sum_y += (r - kOrbRadius) * row;
  }
  std::int32_t sum_x = 0;
  for (int c = 0; c < kDisc; ++c) sum_x += (c - kOrbRadius) * column[c];
  *m10 = sum_x;
  *m01 = sum_y;
}

using I16x8 = std::int16_t __attribute__((vector_size(16)));
using I32x8 = std::int32_t __attribute__((vector_size(32)));

FBVINS_INLINE void load_eight(const std::uint8_t* p, I16x8& out) {
  using U8x8 = std::uint8_t __attribute__((vector_size(8)));
  U8x8 bytes;
  std::memcpy(&bytes, p, sizeof(bytes));
  out = __builtin_convertvector(bytes, I16x8);
}

/// Sums of squared Sobel gradients over 8x8 pixels from `corner` on, a column a lane. A gradient is at most 4 * 255.
FBVINS_KERNEL
void gradient_sums(const std::uint8_t* corner, std::ptrdiff_t s, std::int32_t* xx, std::int32_t* xy, std::int32_t* yy) {
  I16x8 smooth[3] = {}, slope[3] = {};  // of the last three rows: 1 2 1 and -1 0 1
  I32x8 a{}, b{}, c{};
  for (int r = -1; r <= 8; ++r) {
    const std::uint8_t* p = corner + r * s;
    I16x8 left, mid, right;
    load_eight(p - 1, left);
    load_eight(p, mid);
    load_eight(p + 1, right);
    smooth[0] = smooth[1], smooth[1] = smooth[2], smooth[2] = left + 2 * mid + right;
    slope[0] = slope[1], slope[1] = slope[2], slope[2] = right - left;
    if (r < 1) continue;
    const I32x8 gx = __builtin_convertvector(slope[0] + 2 * slope[1] + slope[2], I32x8);
    const I32x8 gy = __builtin_convertvector(smooth[2] - smooth[0], I32x8);
    a += gx * gx;
    b += gx * gy;
    c += gy * gy;
  }
  for (int i = 0; i < 8; ++i) *xx += a[i], *xy += b[i], *yy += c[i];
}

FBVINS_KERNEL
void positive_bits(const std::int16_t* difference, std::uint64_t* words) {
  std::uint8_t positive[256];
  for (int i = 0; i < 256; ++i) positive[i] = difference[i] > 0;
  pack_flags(positive, words);
}

struct PatternLanes {
  float ax[256], ay[256], bx[256], by[256];
  PatternLanes() {
    for (std::size_t i = 0; i < 256; ++i) {
      const PointPair& p = orb_pattern()[i];
      ax[i] = p.ax, ay[i] = p.ay, bx[i] = p.bx, by[i] = p.by;
    }
  }
};

/// Offsets of both points of the pairs after turning and moving by (x, y), rounded to whole pixels.
FBVINS_KERNEL
void turn_pattern(const PatternLanes& lanes, float c, float s, float x, float y, std::int32_t stride, std::int32_t* a,
                  std::int32_t* b) {
  constexpr float kBias = 64.5f;  // truncation of positive numbers rounds without a library call
  const float x0 = x + kBias, y0 = y + kBias;
  for (int i = 0; i < 256; ++i) {
    const auto xa = static_cast<std::int32_t>(c * lanes.ax[i] - s * lanes.ay[i] + x0) - 64;
    const auto ya = static_cast<std::int32_t>(s * lanes.ax[i] + c * lanes.ay[i] + y0) - 64;
    const auto xb = static_cast<std::int32_t>(c * lanes.bx[i] - s * lanes.by[i] + x0) - 64;
    const auto yb = static_cast<std::int32_t>(s * lanes.bx[i] + c * lanes.by[i] + y0) - 64;
    a[i] = ya * stride + xa;
    b[i] = yb * stride + xb;
  }
}

/// Differences to margins; one that is not zero keeps its sign.
FBVINS_KERNEL
void scale_differences(const std::int16_t* difference, std::int8_t* margin) {
  std::int32_t squares = 0;
  for (int i = 0; i < 256; ++i) squares += difference[i] * difference[i];
  const float factor = squares > 0 ? 1 / (kMarginUnit * std::sqrt(static_cast<float>(squares) / 256)) : 0.0f;
  for (int i = 0; i < 256; ++i) {
    const std::int32_t d = difference[i], size = d < 0 ? -d : d;
    std::int32_t m = static_cast<std::int32_t>(static_cast<float>(size) * factor + 0.5f);
    m = m > 127 ? 127 : m;
    m = m < 1 && size > 0 ? 1 : m;
    margin[i] = static_cast<std::int8_t>(d < 0 ? -m : m);
  }
}

}  // namespace

float harris_score(const PyramidLevel& level, int x, int y) {
  std::int32_t xx = 0, xy = 0, yy = 0;
  gradient_sums(level.row(y - 4) + x - 4, level.stride, &xx, &xy, &yy);
  constexpr double kScale = 1.0 / (64.0 * 64.0);  // per pixel, grey/px with Sobel's weight 8
  const double a = xx * kScale, b = xy * kScale, c = yy * kScale;
  return static_cast<float>(a * c - b * b - 0.04 * (a + c) * (a + c));
}

Vec2 centroid_direction(const PyramidLevel& level, int x, int y) {
  std::int32_t m10 = 0, m01 = 0;
  disc_moments(level.row(y - kOrbRadius) + x - kOrbRadius, level.stride, &m10, &m01);
  const double length = std::sqrt(static_cast<double>(m10) * m10 + static_cast<double>(m01) * m01);
  return length > 0 ? Vec2(m10 / length, m01 / length) : Vec2(1, 0);
}

Comparisons compare(const PyramidLevel& smooth, const Vec2& pixel, const Vec2& direction) {
  static const PatternLanes lanes;
  std::int32_t a[256], b[256];
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  turn_pattern(lanes, static_cast<float>(direction.x()), static_cast<float>(direction.y()), static_cast<float>(pixel.x() - x),
               static_cast<float>(pixel.y() - y), static_cast<std::int32_t>(smooth.stride), a, b);
  const std::uint8_t* centre = smooth.row(y) + x;
  Comparisons difference;
  for (std::size_t i = 0; i < 256; ++i) difference[i] = static_cast<std::int16_t>(centre[b[i]] - centre[a[i]]);
  return difference;
}

Descriptor bits_of(const Comparisons& difference) {
  Descriptor descriptor;
  positive_bits(difference.data(), descriptor.bits.data());
  return descriptor;
}

void margins_of(const Comparisons& difference, std::array<std::int8_t, 256>& margins) {
  scale_differences(difference.data(), margins.data());
}

}  // namespace fbvins
