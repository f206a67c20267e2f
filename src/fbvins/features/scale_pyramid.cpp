// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/scale_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/core/simd.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins {
namespace {

constexpr int kEdge = ScalePyramid::kBorder;
constexpr int kSmallestScaledLevel = 64;
constexpr int kSmoothMargin = 8;

/// Two rows blended, weights out of 128.
FBVINS_KERNEL
void blend_rows(const std::uint8_t* r0, const std::uint8_t* r1, int w1, int count, std::uint8_t* out) {
  const auto a = static_cast<std::uint16_t>(128 - w1), b = static_cast<std::uint16_t>(w1);
  for (int x = 0; x < count; ++x) out[x] = static_cast<std::uint8_t>(static_cast<std::uint16_t>(r0[x] * a + r1[x] * b + 64) >> 7);
}

FBVINS_INLINE void pick(const U8x16& from, const U8x16& which, U8x16& out) {
#if defined(__clang__)
  for (int i = 0; i < kLanes; ++i) out[i] = from[which[i]];
#else
  out = __builtin_shuffle(from, which);
#endif
}

/// Left and right neighbours of the pixels of a smaller row: sixteen source pixels give one block by a byte shuffle instead of a
/// collect. The lanes beyond the block are overwritten by the next one.
FBVINS_KERNEL
void pick_neighbours(const std::uint8_t* row, const ShrinkBlock* blocks, int count, int block_px, std::uint8_t* left,
                     std::uint8_t* right) {
  for (int i = 0; i < count; ++i, left += block_px, right += block_px) {
    U8x16 source, picked;
    std::memcpy(&source, row + blocks[i].first, sizeof(source));
    pick(source, blocks[i].left, picked);
    std::memcpy(left, &picked, sizeof(picked));
    pick(source, blocks[i].right, picked);
    std::memcpy(right, &picked, sizeof(picked));
  }
}

/// Weights out of 128: `weight` is right's.
FBVINS_KERNEL
void blend_neighbours(const std::uint8_t* left, const std::uint8_t* right, const std::uint8_t* weight, int count,
                      std::uint8_t* out) {
  for (int x = 0; x < count; ++x)
    out[x] = static_cast<std::uint8_t>(static_cast<std::uint16_t>(left[x] * (128 - weight[x]) + right[x] * weight[x] + 64) >> 7);
}

void replicate_borders(std::uint8_t* origin, int width, int height, std::ptrdiff_t stride) {
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = origin + y * stride;
    std::memset(row - kEdge, row[0], kEdge);
    std::memset(row + width, row[width - 1], kEdge);
  }
  const auto bytes = static_cast<std::size_t>(width + 2 * kEdge);
  for (int i = 1; i <= kEdge; ++i) {
    std::memcpy(origin - kEdge - i * stride, origin - kEdge, bytes);
    std::memcpy(origin - kEdge + (height - 1 + i) * stride, origin - kEdge + (height - 1) * stride, bytes);
  }
}

/// Seven neighbouring pixels: weights 4 9 12 14 12 9 4 out of 64, standard deviation 1.6 px. All sums fit into 16 bits.
FBVINS_INLINE std::uint16_t blend_seven(std::uint16_t p0, std::uint16_t p1, std::uint16_t p2, std::uint16_t p3, std::uint16_t p4,
                                        std::uint16_t p5, std::uint16_t p6) {
  const std::uint16_t outer = static_cast<std::uint16_t>(p0 + p6), middle = static_cast<std::uint16_t>(p1 + p5),
                      inner = static_cast<std::uint16_t>(p2 + p4);
  return static_cast<std::uint16_t>(static_cast<std::uint16_t>(4 * outer + 9 * middle + 12 * inner + 14 * p3 + 32) >> 6);
}

/// To sixteen bits, once for all sums that a pixel is part of.
FBVINS_INLINE void widen(const std::uint8_t* p, int count, std::uint16_t* __restrict out) {
  for (int x = 0; x < count; ++x) out[x] = p[x];
}

/// Across seven rows, which are `step` apart.
FBVINS_INLINE void blend_rows_of_seven(const std::uint16_t* p, std::ptrdiff_t step, int count, std::uint16_t* __restrict out) {
  for (int x = 0; x < count; ++x)
    out[x] = blend_seven(p[x], p[x + step], p[x + 2 * step], p[x + 3 * step], p[x + 4 * step], p[x + 5 * step], p[x + 6 * step]);
}

/// Along a row, from three pixels right of p on.
FBVINS_INLINE void blend_along(const std::uint16_t* p, int count, std::uint8_t* __restrict out) {
  for (int x = 0; x < count; ++x)
    out[x] = static_cast<std::uint8_t>(blend_seven(p[x], p[x + 1], p[x + 2], p[x + 3], p[x + 4], p[x + 5], p[x + 6]));
}

FBVINS_KERNEL
void widen_row(const std::uint8_t* p, int count, std::uint16_t* out) { widen(p, count, out); }

FBVINS_KERNEL
void smooth_wide_rows(const std::uint16_t* rows, std::ptrdiff_t step, int count, std::uint16_t* columns, std::uint8_t* out) {
  blend_rows_of_seven(rows, step, count + 6, columns);
  blend_along(columns, count, out);
}

FBVINS_KERNEL
void smooth_rows_of_patch(const std::uint8_t* centre, std::ptrdiff_t stride, std::uint8_t* out) {
  constexpr int kSide = SmoothPatch::kSide + 6, kWidth = 5 * kLanes / 2;
  std::uint16_t wide[kSide * kWidth], columns[3 * kLanes] = {};
  const std::uint8_t* corner = centre - (kSide / 2) * (stride + 1);
  for (int y = 0; y < kSide; ++y) widen(corner + y * stride, kWidth, wide + y * kWidth);
  for (int y = 0; y < SmoothPatch::kSide; ++y, out += SmoothPatch::kStride) {
    blend_rows_of_seven(wide + y * kWidth, kWidth, kWidth, columns);
    blend_along(columns, SmoothPatch::kStride, out);
  }
}

}  // namespace

void ScalePyramid::shrink(const PyramidLevel& from, double ratio, const PyramidLevel& to, std::uint8_t* origin) {
  const int block_px = std::min(kLanes, static_cast<int>((kLanes - 3) / ratio) + 1);
  const int count = (to.width + block_px - 1) / block_px;
  const std::size_t picked = static_cast<std::size_t>(count * block_px + kLanes);
  blocks_.assign(static_cast<std::size_t>(count), ShrinkBlock{});
  weights_.resize(picked);
  for (int i = 0; i < count; ++i) {
    ShrinkBlock& block = blocks_[static_cast<std::size_t>(i)];
    for (int k = 0; k < block_px; ++k) {
      const double at = std::clamp((i * block_px + k + 0.5) * ratio - 0.5, 0.0, from.width - 1.0);
      const int column = static_cast<int>(at);
      if (k == 0) block.first = column;
      block.left[k] = static_cast<std::uint8_t>(column - block.first);
      block.right[k] = static_cast<std::uint8_t>(column - block.first + 1);
      weights_[static_cast<std::size_t>(i * block_px + k)] = static_cast<std::uint8_t>((at - column) * 128.0 + 0.5);
    }
  }
  row_.resize(static_cast<std::size_t>(from.width) + 2 * kLanes + 2 * picked);
  std::uint8_t* left = row_.data() + from.width + 2 * kLanes;
  std::uint8_t* right = left + picked;
  for (int y = 0; y < to.height; ++y) {
    const double at = std::clamp((y + 0.5) * ratio - 0.5, 0.0, from.height - 1.0);
    const int row = static_cast<int>(at);
    const int w1 = static_cast<int>((at - row) * 128.0 + 0.5);
    blend_rows(from.row(row), from.row(row + 1), w1, from.width + 1, row_.data());
    pick_neighbours(row_.data(), blocks_.data(), count, block_px, left, right);
    blend_neighbours(left, right, weights_.data(), to.width, origin + y * to.stride);
  }
}

void ScalePyramid::build(const ImageView& image, int levels, double factor) {
  levels_.clear();
  scales_.clear();
  if (image.empty()) return;
  std::size_t total = 0;
  double scale = 1.0;
  for (int l = 0; l < levels; ++l, scale *= factor) {
    const int width = static_cast<int>(std::lround(image.width / scale));
    const int height = static_cast<int>(std::lround(image.height / scale));
    if (l > 0 && std::min(width, height) < kSmallestScaledLevel) break;
    levels_.push_back({nullptr, width, height, padded_stride(width, kEdge)});
    scales_.push_back(scale);
    total += static_cast<std::size_t>(padded_stride(width, kEdge)) * static_cast<std::size_t>(height + 2 * kEdge);
  }
  pixels_.resize(total + 64);
  std::uint8_t* place = pixels_.data();
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    PyramidLevel& level = levels_[l];
    std::uint8_t* origin = place + kEdge * level.stride + kEdge;
    level.origin = origin;
    place += level.stride * (level.height + 2 * kEdge);
    if (l == 0)
      for (int y = 0; y < level.height; ++y)
        std::memcpy(origin + y * level.stride, image.row(y), static_cast<std::size_t>(level.width));
    else shrink(levels_[l - 1], scales_[l] / scales_[l - 1], level, origin);
    replicate_borders(origin, level.width, level.height, level.stride);
  }
}

PyramidLevel smooth_level(const PyramidLevel& level, std::vector<std::uint8_t>& out, std::vector<std::uint16_t>& scratch) {
  const int margin = kSmoothMargin, side = margin + 3, wide = level.width + 2 * side;
  const std::size_t rows = static_cast<std::size_t>(level.height + 2 * margin);
  const std::size_t pitch = static_cast<std::size_t>(level.stride);
  if (out.size() < rows * pitch + 64) out.resize(rows * pitch + 64);
  // The last seven rows lie one after the other: each is written twice, seven places apart.
  if (scratch.size() < 15 * pitch + 64) scratch.resize(15 * pitch + 64);
  const auto place = [&](int y) { return scratch.data() + static_cast<std::size_t>((y + side) % 7) * pitch; };
  const auto take = [&](int y) {
    widen_row(level.row(y) - side, wide, place(y));
    std::memcpy(place(y) + 7 * pitch, place(y), static_cast<std::size_t>(wide) * sizeof(std::uint16_t));
  };
  for (int y = -side; y < 3 - margin; ++y) take(y);
  std::uint8_t* origin = out.data() + static_cast<std::size_t>(margin) * pitch + margin;
  for (int y = -margin; y < level.height + margin; ++y) {
    take(y + 3);
    smooth_wide_rows(place(y - 3), level.stride, level.width + 2 * margin, scratch.data() + 14 * pitch,
                     origin + y * level.stride - margin);
  }
  return {origin, level.width, level.height, level.stride};
}

PyramidLevel smooth_patch(const PyramidLevel& level, int x, int y, SmoothPatch& out) {
  smooth_rows_of_patch(level.row(y) + x, level.stride, out.pixels);
  return {out.pixels, SmoothPatch::kSide, SmoothPatch::kSide, SmoothPatch::kStride};
}

}  // namespace fbvins
