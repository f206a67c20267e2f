// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/fast.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins {
namespace {

constexpr int kBlock = kFastBlock;
using U8x32 = std::uint8_t __attribute__((vector_size(kBlock)));

FBVINS_INLINE void load(const std::uint8_t* p, U8x32& v) { std::memcpy(&v, p, sizeof(v)); }
FBVINS_INLINE void smaller(const U8x32& a, const U8x32& b, U8x32& out) { out = a < b ? a : b; }
FBVINS_INLINE void larger(const U8x32& a, const U8x32& b, U8x32& out) { out = a > b ? a : b; }

/// max over the 16 arcs of the min over their 9 members. The arcs from k and from k + 1 share the eight
/// members k+1 .. k+8, so their minimum is built once for both.
FBVINS_INLINE void strongest_arc(const U8x32 (&d)[16], U8x32& best) {
  U8x32 two[8], four[8];
  for (int i = 0; i < 8; ++i) smaller(d[2 * i + 1], d[(2 * i + 2) & 15], two[i]);
  for (int i = 0; i < 8; ++i) smaller(two[i], two[(i + 1) & 7], four[i]);
  best = U8x32{};
  for (int i = 0; i < 8; ++i) {
    U8x32 eight, end;
    smaller(four[i], four[(i + 2) & 7], eight);
    larger(d[2 * i], d[(2 * i + 9) & 15], end);
    smaller(eight, end, eight);
    larger(best, eight, best);
  }
}

/// The sixteen pixels around the centre, clockwise from above it.
struct Circle {
  std::ptrdiff_t at[16];
  explicit Circle(std::ptrdiff_t stride)
      : at{-3 * stride, -3 * stride + 1, -2 * stride + 2, -stride + 3, 3,  stride + 3,  2 * stride + 2,  3 * stride + 1,
           3 * stride,  3 * stride - 1,  2 * stride - 2,  stride - 3,  -3, -stride - 3, -2 * stride - 2, -3 * stride - 1} {}
};

/// How much brighter and how much darker than the centre.
FBVINS_INLINE void differ(const std::uint8_t* at, const U8x32& c, U8x32& bright, U8x32& dark) {
  U8x32 p, hi, lo;
  load(at, p);
  larger(p, c, hi);
  smaller(p, c, lo);
  bright = hi - c;
  dark = c - lo;
}

FBVINS_INLINE void strength_of_block(const std::uint8_t* centre, const Circle& circle, U8x32& best) {
  U8x32 c, bright[16], dark[16], best_dark;
  load(centre, c);
  for (int i = 0; i < 16; ++i) differ(centre + circle.at[i], c, bright[i], dark[i]);
  strongest_arc(bright, best);
  strongest_arc(dark, best_dark);
  larger(best, best_dark, best);
}

/// An upper bound of the strengths: each arc of nine holds at least one of two opposite pixels, here `first` or `first` + 8, and
/// `first` + 4 or `first` + 12.
FBVINS_INLINE void bound_of_block(const std::uint8_t* centre, const Circle& circle, int first, U8x32& bound) {
  U8x32 c, bright[4], dark[4];
  load(centre, c);
  for (int i = 0; i < 4; ++i) differ(centre + circle.at[first + 4 * i], c, bright[i], dark[i]);
  for (int i = 0; i < 2; ++i) {
    larger(bright[i], bright[i + 2], bright[i]);
    larger(dark[i], dark[i + 2], dark[i]);
  }
  smaller(bright[0], bright[1], bright[0]);
  smaller(dark[0], dark[1], dark[0]);
  larger(bright[0], dark[0], bound);
}

FBVINS_INLINE bool exceeds(const U8x32& v, std::uint8_t limit) {
  const U8x32 more = v > limit ? v : U8x32{};
  std::uint64_t words[4];
  std::memcpy(words, &more, sizeof(words));
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

/// Few pixels remain: eight at a time are tested as one integer.
void collect_row(const std::uint8_t* kept, int count, int x0, int y, std::vector<FastCorner>& out) {
  static_assert(std::endian::native == std::endian::little, "the lowest byte must be the first pixel");
  for (int block = 0; block < count; block += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, kept + block, sizeof(eight));
    while (eight != 0) {
      const int k = std::countr_zero(eight) / 8;
      out.push_back(
          {static_cast<std::int16_t>(x0 + block + k), static_cast<std::int16_t>(y), static_cast<std::uint8_t>(eight >> (8 * k))});
      eight &= ~(std::uint64_t{0xff} << (8 * k));
    }
  }
}

}  // namespace

FBVINS_KERNEL
void fast_strength_row(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t* strength) {
  const Circle circle(stride);
  for (int x = 0; x < count; x += kBlock) {
    U8x32 best;
    strength_of_block(centre + x, circle, best);
    std::memcpy(strength + x, &best, sizeof(best));
  }
}

FBVINS_KERNEL
void fast_strength_row_above(const std::uint8_t* centre, std::ptrdiff_t stride, int count, const std::uint8_t* limits,
                             std::uint8_t* strength) {
  const Circle circle(stride);
  for (int x = 0; x < count; x += kBlock) {
    U8x32 best{}, bound;
    const std::uint8_t limit = limits[x / kBlock];
    bound_of_block(centre + x, circle, 0, bound);
    if (exceeds(bound, limit)) {
      bound_of_block(centre + x, circle, 2, bound);
      if (exceeds(bound, limit)) strength_of_block(centre + x, circle, best);
    }
    std::memcpy(strength + x, &best, sizeof(best));
  }
}

FBVINS_KERNEL
void keep_local_maxima(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int count,
                       const std::uint8_t* limits, std::uint8_t* kept) {
  for (int x = 0; x < count; ++x) {
    const std::uint8_t s = here[x];
    std::uint8_t before = std::max(above[x - 1], above[x]);
    before = std::max(before, above[x + 1]);
    before = std::max(before, here[x - 1]);
    before = std::max(before, limits[x]);
    std::uint8_t after = std::max(below[x - 1], below[x]);
    after = std::max(after, below[x + 1]);
    after = std::max(after, here[x + 1]);
    const bool keep = (s > before) & (s >= after);
    kept[x] = keep ? s : std::uint8_t{0};
  }
}

void detect_fast(const PyramidLevel& level, int border, int floor, FastBuffers& buffers, std::vector<FastCorner>& out) {
  assert(border >= 4);
  out.clear();
  const int count = level.width - 2 * border;
  if (count <= 0 || level.height <= 2 * border) return;
  // Strengths one column and one row beyond the wanted area, for the neighbours' comparison.
  const int with_sides = count + 2;
  const std::size_t pitch = static_cast<std::size_t>((with_sides + kBlock - 1) / kBlock * kBlock + kBlock);
  buffers.rows.resize(4 * pitch);
  std::uint8_t* ring[3] = {buffers.rows.data(), buffers.rows.data() + pitch, buffers.rows.data() + 2 * pitch};
  std::uint8_t* kept = buffers.rows.data() + 3 * pitch;
  std::memset(kept, 0, pitch);
  buffers.limits.assign(pitch, static_cast<std::uint8_t>(floor));

  const auto fill = [&](int y) { fast_strength_row(level.row(y) + border - 1, level.stride, with_sides, ring[y % 3]); };
  fill(border - 1);
  fill(border);
  for (int y = border; y < level.height - border; ++y) {
    fill(y + 1);
    keep_local_maxima(ring[(y + 2) % 3] + 1, ring[y % 3] + 1, ring[(y + 1) % 3] + 1, count, buffers.limits.data(), kept);
    collect_row(kept, count, border, y, out);
  }
}

}  // namespace fbvins
