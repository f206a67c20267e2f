// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/scale_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fbvins/core/simd.hpp"

namespace fbvins {
namespace {

constexpr int kBorder = ScalePyramid::kBorder;
constexpr int kSmallestLevel = 64;
constexpr int kSmoothMargin = 8;

std::ptrdiff_t padded_stride(int width) { return (width + 2 * kBorder + 63) / 64 * 64; }

/// Two rows blended (weights out of 128); each result holds its right neighbour in the upper half.
FBVINS_KERNEL
void blend_rows(const std::uint8_t* r0, const std::uint8_t* r1, int w1, int count, std::uint32_t* pairs) {
  const auto a = static_cast<std::uint32_t>(128 - w1), b = static_cast<std::uint32_t>(w1);
  for (int x = 0; x < count; ++x) {
    const std::uint32_t here = r0[x] * a + r1[x] * b;
    const std::uint32_t next = r0[x + 1] * a + r1[x + 1] * b;
    pairs[x] = here | (next << 16);
  }
}

/// Scalar on purpose: gathers are slower than this on the machines measured.
void blend_columns(const std::uint32_t* pairs, const std::int32_t* column, const std::int32_t* weight, int count,
                   std::uint8_t* out) {
  for (int x = 0; x < count; ++x) {
    const std::uint32_t pair = pairs[column[x]];
    const auto w = static_cast<std::uint32_t>(weight[x]);
    const std::uint32_t v = (pair & 0xffffu) * (128 - w) + (pair >> 16) * w;
    out[x] = static_cast<std::uint8_t>((v + (1u << 13)) >> 14);
  }
}

void replicate_borders(std::uint8_t* origin, int width, int height, std::ptrdiff_t stride) {
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = origin + y * stride;
    std::memset(row - kBorder, row[0], kBorder);
    std::memset(row + width, row[width - 1], kBorder);
  }
  const auto bytes = static_cast<std::size_t>(width + 2 * kBorder);
  for (int i = 1; i <= kBorder; ++i) {
    std::memcpy(origin - kBorder - i * stride, origin - kBorder, bytes);
    std::memcpy(origin - kBorder + (height - 1 + i) * stride, origin - kBorder + (height - 1) * stride, bytes);
  }
}

// Weights 4 9 12 14 12 9 4 out of 64: standard deviation 1.6 px. All sums fit into 16 bits.
FBVINS_KERNEL
void smooth_columns(const std::uint8_t* centre, std::ptrdiff_t s, int count, std::uint8_t* out) {
  for (int x = 0; x < count; ++x) {
    const std::uint16_t outer = static_cast<std::uint16_t>(centre[x - 3 * s] + centre[x + 3 * s]);
    const std::uint16_t middle = static_cast<std::uint16_t>(centre[x - 2 * s] + centre[x + 2 * s]);
    const std::uint16_t inner = static_cast<std::uint16_t>(centre[x - s] + centre[x + s]);
    const std::uint16_t sum = static_cast<std::uint16_t>(4 * outer + 9 * middle + 12 * inner + 14 * centre[x] + 32);
    out[x] = static_cast<std::uint8_t>(sum >> 6);
  }
}

FBVINS_KERNEL
void smooth_row(const std::uint8_t* row, int count, std::uint8_t* out) {
  for (int x = 0; x < count; ++x) {
    const std::uint16_t outer = static_cast<std::uint16_t>(row[x - 3] + row[x + 3]);
    const std::uint16_t middle = static_cast<std::uint16_t>(row[x - 2] + row[x + 2]);
    const std::uint16_t inner = static_cast<std::uint16_t>(row[x - 1] + row[x + 1]);
    const std::uint16_t sum = static_cast<std::uint16_t>(4 * outer + 9 * middle + 12 * inner + 14 * row[x] + 32);
    out[x] = static_cast<std::uint8_t>(sum >> 6);
  }
}

}  // namespace

void ScalePyramid::shrink(const PyramidLevel& from, double ratio, const PyramidLevel& to, std::uint8_t* origin) {
  column_.resize(static_cast<std::size_t>(to.width));
  weight_.resize(static_cast<std::size_t>(to.width));
  pairs_.resize(static_cast<std::size_t>(from.width) + 1);
  for (int x = 0; x < to.width; ++x) {
    const double at = std::clamp((x + 0.5) * ratio - 0.5, 0.0, from.width - 1.0);
    const int column = static_cast<int>(at);
    column_[static_cast<std::size_t>(x)] = column;
    weight_[static_cast<std::size_t>(x)] = static_cast<int>((at - column) * 128.0 + 0.5);
  }
  for (int y = 0; y < to.height; ++y) {
    const double at = std::clamp((y + 0.5) * ratio - 0.5, 0.0, from.height - 1.0);
    const int row = static_cast<int>(at);
    const int w1 = static_cast<int>((at - row) * 128.0 + 0.5);
    blend_rows(from.row(row), from.row(row + 1), w1, from.width, pairs_.data());
    blend_columns(pairs_.data(), column_.data(), weight_.data(), to.width, origin + y * to.stride);
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
    if (l > 0 && std::min(width, height) < kSmallestLevel) break;
    levels_.push_back({nullptr, width, height, padded_stride(width)});
    scales_.push_back(scale);
    total += static_cast<std::size_t>(padded_stride(width)) * static_cast<std::size_t>(height + 2 * kBorder);
  }
  pixels_.resize(total + 64);
  std::uint8_t* place = pixels_.data();
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    PyramidLevel& level = levels_[l];
    std::uint8_t* origin = place + kBorder * level.stride + kBorder;
    level.origin = origin;
    place += level.stride * (level.height + 2 * kBorder);
    if (l == 0)
      for (int y = 0; y < level.height; ++y)
        std::memcpy(origin + y * level.stride, image.row(y), static_cast<std::size_t>(level.width));
    else
      shrink(levels_[l - 1], scales_[l] / scales_[l - 1], level, origin);
    replicate_borders(origin, level.width, level.height, level.stride);
  }
}

PyramidLevel smooth_level(const PyramidLevel& level, std::vector<std::uint8_t>& out, std::vector<std::uint8_t>& scratch) {
  const int margin = kSmoothMargin, side = margin + 3;
  const std::size_t rows = static_cast<std::size_t>(level.height + 2 * margin);
  const std::size_t pitch = static_cast<std::size_t>(level.stride);
  if (out.size() < rows * pitch + 64) out.resize(rows * pitch + 64);
  if (scratch.size() < pitch + 64) scratch.resize(pitch + 64);
  std::uint8_t* origin = out.data() + static_cast<std::size_t>(margin) * pitch + margin;
  for (int y = -margin; y < level.height + margin; ++y) {
    smooth_columns(level.row(y) - side, level.stride, level.width + 2 * side, scratch.data());
    smooth_row(scratch.data() + 3, level.width + 2 * margin, origin + y * level.stride - margin);
  }
  return {origin, level.width, level.height, level.stride};
}

}  // namespace fbvins
