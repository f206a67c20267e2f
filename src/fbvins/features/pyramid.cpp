// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/pyramid.hpp"

#include <algorithm>
#include <cstring>

#include "fbvins/core/simd.hpp"

namespace fbvins {
namespace {

constexpr int kBorder = kPyramidBorder;
constexpr int kSmallestLevel = 16;

/// Weighted sum 1 4 6 4 1 of five rows.
FBVINS_KERNEL
void filter_columns(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint16_t* sums) {
  const std::uint8_t* r0 = centre - 2 * stride;
  const std::uint8_t* r1 = centre - stride;
  const std::uint8_t* r3 = centre + stride;
  const std::uint8_t* r4 = centre + 2 * stride;
  for (int x = 0; x < count; ++x) sums[x] = static_cast<std::uint16_t>(r0[x] + r4[x] + 4 * (r1[x] + r3[x]) + 6 * centre[x]);
}

/// Weighted sum 1 4 6 4 1 of five columns at every second place; sums[0] belongs to column -2.
/// 255 * 256 + 128 still fits into 16 bits.
FBVINS_KERNEL
void filter_rows_and_halve(const std::uint16_t* sums, int count, std::uint8_t* out) {
  for (int x = 0; x < count; ++x) {
    const std::uint16_t* s = sums + 2 * x;
    const auto total = static_cast<std::uint16_t>(s[0] + s[4] + 4 * (s[1] + s[3]) + 6 * s[2] + 128);
    out[x] = static_cast<std::uint8_t>(total >> 8);
  }
}

FBVINS_KERNEL
std::uint32_t sum_row(const std::uint8_t* row, int count) {
  std::uint32_t sum = 0;
  for (int x = 0; x < count; ++x) sum += row[x];
  return sum;
}

void replicate_sides(std::uint8_t* row, int width) {
  std::memset(row - kBorder, row[0], kBorder);
  std::memset(row + width, row[width - 1], kBorder);
}

void replicate_top_and_bottom(std::uint8_t* origin, int width, int height, std::ptrdiff_t stride) {
  const auto bytes = static_cast<std::size_t>(width + 2 * kBorder);
  const std::uint8_t* first = origin - kBorder;
  const std::uint8_t* last = first + (height - 1) * stride;
  for (int i = 1; i <= kBorder; ++i) {
    std::memcpy(origin - kBorder - i * stride, first, bytes);
    std::memcpy(origin - kBorder + (height - 1 + i) * stride, last, bytes);
  }
}

std::size_t padded_size(int width, int height) {
  return static_cast<std::size_t>(padded_stride(width, kBorder)) * static_cast<std::size_t>(height + 2 * kBorder);
}

}  // namespace

void Pyramid::build(const ImageView& image, int levels) {
  levels_.clear();
  if (image.empty()) return;
  std::size_t total = 0;
  int width = image.width, height = image.height;
  for (int l = 0; l < std::min(levels, kMaxPyramidLevels); ++l) {
    if (l > 0 && std::min(width, height) < kSmallestLevel) break;
    levels_.push_back({nullptr, width, height, padded_stride(width, kBorder)});
    total += padded_size(width, height);
    width = (width + 1) / 2;
    height = (height + 1) / 2;
  }
  // Kernels may read a few bytes past the last row. A buffer that shrank would be filled with zeros when it grows again.
  if (pixels_.size() < total + 64) pixels_.resize(total + 64);
  column_sums_.resize(static_cast<std::size_t>(image.width) + 2 * kBorder);

  std::uint8_t* place = pixels_.data();
  std::uint8_t* above = nullptr;
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    PyramidLevel& level = levels_[l];
    std::uint8_t* origin = place + kBorder * level.stride + kBorder;
    level.origin = origin;
    place += padded_size(level.width, level.height);
    for (int y = 0; y < level.height; ++y) {
      std::uint8_t* row = origin + y * level.stride;
      if (l == 0) {
        std::memcpy(row, image.row(y), static_cast<std::size_t>(level.width));
      } else {
        const PyramidLevel& fine = levels_[l - 1];
        filter_columns(above + 2 * y * fine.stride - 2, fine.stride, 2 * level.width + 3, column_sums_.data());
        filter_rows_and_halve(column_sums_.data(), level.width, row);
      }
      replicate_sides(row, level.width);
    }
    replicate_top_and_bottom(origin, level.width, level.height, level.stride);
    above = origin;
  }
}

double mean_brightness(const Pyramid& pyramid) {
  if (pyramid.empty()) return 0;
  const PyramidLevel& level = pyramid.level(std::min(1, pyramid.levels() - 1));
  double sum = 0;
  int rows = 0;
  for (int y = 0; y < level.height; y += 2, ++rows) sum += sum_row(level.row(y), level.width);
  return sum / (static_cast<double>(rows) * level.width);
}

}  // namespace fbvins
