// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/fast.hpp"

#include <algorithm>
#include <cstring>

#include "fbvins/core/lanes.hpp"

namespace fbvins {
namespace {

constexpr int kBlock = kFastBlock;
using Block = Lanes<std::uint8_t, kBlock>;
using Bytes = Block::Part;

FBVINS_INLINE void load(const std::uint8_t* p, Bytes& v) { std::memcpy(&v, p, sizeof(v)); }
FBVINS_INLINE void smaller(const Bytes& a, const Bytes& b, Bytes& out) { out = a < b ? a : b; }
FBVINS_INLINE void larger(const Bytes& a, const Bytes& b, Bytes& out) { out = a > b ? a : b; }

/// The sixteen pixels around the centre, clockwise from above it.
struct Circle {
  std::ptrdiff_t at[16];
  explicit Circle(std::ptrdiff_t stride)
      : at{-3 * stride, -3 * stride + 1, -2 * stride + 2, -stride + 3, 3,  stride + 3,  2 * stride + 2,  3 * stride + 1,
           3 * stride,  3 * stride - 1,  2 * stride - 2,  stride - 3,  -3, -stride - 3, -2 * stride - 2, -3 * stride - 1} {}
};

/// The seven rows that a pixel's circle lies in.
struct Rows {
  const std::uint8_t* at[7];
  Rows(const std::uint8_t* centre, std::ptrdiff_t stride) {
    for (int i = 0; i < 7; ++i) at[i] = centre + (i - 3) * stride;
  }
};

/// The sixteen pixels around the centre, clockwise from above it.
constexpr int kRight[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr int kDown[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

FBVINS_INLINE void load_circle(const Rows& rows, int x, Bytes (&p)[16]) {
#pragma GCC unroll 16
  for (int i = 0; i < 16; ++i) load(rows.at[3 + kDown[i]] + x + kRight[i], p[i]);
}

/// Of the brightest arc the darkest pixel, or, with `Dark`, of the darkest arc the brightest: over the 16 arcs of 9 pixels. The
/// four arcs from k to k + 3 share the six members k+3 .. k+8, whose extreme is built once for them, and two of them two more
/// each.
template <bool Dark>
FBVINS_INLINE void best_arc(const Bytes (&p)[16], Bytes& best) {
  const auto worse = [](const Bytes& a, const Bytes& b, Bytes& out) __attribute__((always_inline)) {
    Dark ? larger(a, b, out) : smaller(a, b, out);
  };
  const auto better = [](const Bytes& a, const Bytes& b, Bytes& out) __attribute__((always_inline)) {
    Dark ? smaller(a, b, out) : larger(a, b, out);
  };
  Bytes two[8];  // from 2i + 1 on
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i) worse(p[2 * i + 1], p[(2 * i + 2) & 15], two[i]);
#pragma GCC unroll 4
  for (int k = 0; k < 16; k += 4) {
    Bytes six, first, last;
    worse(two[k / 2 + 1], two[(k / 2 + 2) & 7], six);
    worse(six, two[(k / 2 + 3) & 7], six);
    better(p[k], p[(k + 9) & 15], first);  // arcs from k and k + 1
    worse(first, two[k / 2], first);
    better(p[k + 2], p[(k + 11) & 15], last);  // arcs from k + 2 and k + 3
    worse(last, two[(k / 2 + 4) & 7], last);
    better(first, last, first);
    worse(six, first, six);
    if (k == 0) best = six;
    else better(best, six, best);
  }
}

/// How much an arc is brighter or darker than the centre, whose extremes these are.
FBVINS_INLINE void difference(const Bytes& centre, const Bytes& bright, const Bytes& dark, Bytes& out) {
  Bytes above, below;
  larger(bright, centre, above);
  smaller(dark, centre, below);
  above -= centre;
  below = centre - below;
  larger(above, below, out);
}

FBVINS_INLINE void strength_at(const Rows& rows, int x, Bytes& strength) {
  Bytes c, p[16], bright, dark;
  load_circle(rows, x, p);
  best_arc<false>(p, bright);
  best_arc<true>(p, dark);
  load(rows.at[3] + x, c);
  difference(c, bright, dark, strength);
}

/// Zero where the limit is not exceeded.
FBVINS_INLINE void excess_of(const Bytes& strength, const std::uint8_t* limits, Bytes& excess) {
  Bytes limit;
  load(limits, limit);
  larger(strength, limit, excess);
  excess -= limit;
}

FBVINS_INLINE bool any(const Bytes& v) {
  using Half = std::uint64_t __attribute__((vector_size(16)));
  Half halves[sizeof(Bytes) / sizeof(Half)];
  std::memcpy(halves, &v, sizeof(halves));
  for (std::size_t i = 1; i < std::size(halves); ++i) halves[0] |= halves[i];
  return (halves[0][0] | halves[0][1]) != 0;
}

}  // namespace

FBVINS_KERNEL
void fast_strength_row(const std::uint8_t* centre, std::ptrdiff_t stride, int count, const std::uint8_t* limits,
                       std::uint8_t* strength, std::uint8_t* found) {
  const Rows rows(centre, stride);
  for (int x = 0; x < count; x += kBlock) {
    Bytes excess, exceeded{};
#pragma GCC unroll 2
    for (int i = 0; i < Block::kParts; ++i) {
      const int first = x + i * Block::kInPart;
      Bytes best;
      strength_at(rows, first, best);
      excess_of(best, limits + first, excess);
      exceeded |= excess;
      std::memcpy(strength + first, &best, sizeof(best));
    }
    found[x / kBlock] = any(exceeded);
  }
}

FBVINS_KERNEL
void keep_local_maxima(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int count,
                       const std::uint8_t* limits, const std::uint8_t* found, std::uint8_t* kept) {
  for (int block = 0; block < count; block += kBlock) {
    if (!found[block / kBlock]) continue;
    for (int x = block; x < block + kBlock; ++x) {
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
}

}  // namespace fbvins
