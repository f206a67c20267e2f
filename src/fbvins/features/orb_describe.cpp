// SPDX-License-Identifier: Apache-2.0
// Harris score, orientation and bits of one keypoint.
#include <cmath>
#include <cstdlib>

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

/// Sums of squared Sobel gradients over 8x8 pixels from `corner` on. A gradient is at most 4 * 255.
FBVINS_KERNEL
void gradient_sums(const std::uint8_t* corner, std::ptrdiff_t stride, std::int32_t* xx, std::int32_t* xy, std::int32_t* yy) {
  constexpr int kBlock = 8;
  std::int16_t smooth[(kBlock + 2) * kBlock], slope[(kBlock + 2) * kBlock];  // along each row: 1 2 1 and -1 0 1
  for (int r = 0; r < kBlock + 2; ++r) {
    const std::uint8_t* p = corner + (r - 1) * stride;
    for (int c = 0; c < kBlock; ++c) {
      const std::int16_t left = p[c - 1], mid = p[c], right = p[c + 1];
      smooth[r * kBlock + c] = static_cast<std::int16_t>(left + 2 * mid + right);
      slope[r * kBlock + c] = static_cast<std::int16_t>(right - left);
    }
  }
  std::int16_t gx[kBlock * kBlock], gy[kBlock * kBlock];
  for (int i = 0; i < kBlock * kBlock; ++i) {
    gx[i] = static_cast<std::int16_t>(slope[i] + 2 * slope[i + kBlock] + slope[i + 2 * kBlock]);
    gy[i] = static_cast<std::int16_t>(smooth[i + 2 * kBlock] - smooth[i]);
  }
  std::int32_t a = 0, b = 0, c = 0;
  for (int i = 0; i < kBlock * kBlock; ++i) a += gx[i] * gx[i];
  for (int i = 0; i < kBlock * kBlock; ++i) b += gx[i] * gy[i];
  for (int i = 0; i < kBlock * kBlock; ++i) c += gy[i] * gy[i];
  *xx = a, *xy = b, *yy = c;
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

/// Places of both points of the pairs after turning and moving by (x, y), rounded to whole pixels, counted from the pixel
/// kPatternRadius left of and above the centre.
FBVINS_KERNEL
void turn_pattern(const PatternLanes& lanes, float c, float s, float x, float y, std::int32_t stride, std::uint32_t* a,
                  std::uint32_t* b) {
  constexpr int kWhole = 64;
  constexpr float kBias = kWhole + 0.5f;  // truncation of positive numbers rounds without a library call
  const float x0 = x + kBias, y0 = y + kBias;
  const std::int32_t first = (kWhole - kPatternRadius) * (stride + 1);
  for (int i = 0; i < 256; ++i) {
    const auto xa = static_cast<std::int32_t>(c * lanes.ax[i] - s * lanes.ay[i] + x0);
    const auto ya = static_cast<std::int32_t>(s * lanes.ax[i] + c * lanes.ay[i] + y0);
    const auto xb = static_cast<std::int32_t>(c * lanes.bx[i] - s * lanes.by[i] + x0);
    const auto yb = static_cast<std::int32_t>(s * lanes.bx[i] + c * lanes.by[i] + y0);
    a[i] = static_cast<std::uint32_t>(ya * stride + xa - first);
    b[i] = static_cast<std::uint32_t>(yb * stride + xb - first);
  }
}

/// Differences to margins; one that is not zero keeps its sign. In steps that each keep to one width of numbers.
FBVINS_KERNEL
void scale_differences(const std::int16_t* difference, std::int8_t* margin) {
  std::int32_t squares = 0;
  for (int i = 0; i < 256; ++i) squares += difference[i] * difference[i];
  const float factor = squares > 0 ? 1 / (kMarginUnit * std::sqrt(static_cast<float>(squares) / 256)) : 0.0f;
  std::int16_t size[256], scaled[256];  // at most 255, and 512: where all but one difference are zero
  for (int i = 0; i < 256; ++i) size[i] = static_cast<std::int16_t>(std::abs(difference[i]));
  for (int i = 0; i < 256; ++i)
    scaled[i] = static_cast<std::int16_t>(static_cast<std::int32_t>(static_cast<float>(size[i]) * factor + 0.5f));
  for (int i = 0; i < 256; ++i) {
    const std::int16_t least = size[i] < 1 ? size[i] : std::int16_t{1};
    std::int16_t m = scaled[i] > 127 ? std::int16_t{127} : scaled[i];
    m = m < least ? least : m;
    margin[i] = static_cast<std::int8_t>(difference[i] < 0 ? static_cast<std::int16_t>(-m) : m);
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
  std::uint32_t a[256], b[256];
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  turn_pattern(lanes, static_cast<float>(direction.x()), static_cast<float>(direction.y()), static_cast<float>(pixel.x() - x),
               static_cast<float>(pixel.y() - y), static_cast<std::int32_t>(smooth.stride), a, b);
  const std::uint8_t* first = smooth.row(y - kPatternRadius) + x - kPatternRadius;
  Comparisons difference;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 256; ++i) difference[i] = static_cast<std::int16_t>(first[b[i]] - first[a[i]]);
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
