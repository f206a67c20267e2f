// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/int8_gemm.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/simd.hpp"
#include "fbvins/features/int8_kernels.hpp"
#include "fbvins/features/lanes.hpp"

namespace fbvins {
namespace {

/// Adding and taking away 1.5 * 2^23 rounds to the nearest whole number, in one instruction each.
constexpr float kRounder = 12582912.0f;
/// Columns of a block of sums.
constexpr int kColumns = 16 * kInt8BlocksTogether;

FBVINS_INLINE float largest_magnitude(const float* x, int n) {
  // Of float lanes in an array: GCC 12 compares those of a vector wider than a register one by one.
  float lanes[kLanes] = {}, most = 0;
  int i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (int l = 0; l < kLanes; ++l) lanes[l] = std::fabs(x[i + l]) > lanes[l] ? std::fabs(x[i + l]) : lanes[l];
  for (; i < n; ++i) most = std::max(most, std::fabs(x[i]));
  for (const float lane : lanes) most = std::max(most, lane);
  return most;
}

/// Each row is scaled by its own largest magnitude.
FBVINS_KERNEL
void quantise_rows(const float* x, int rows, int columns, std::int8_t* out, float* scale) {
  for (int r = 0; r < rows; ++r, x += columns, out += columns) {
    const float most = largest_magnitude(x, columns), factor = most > 0 ? 127.0f / most : 0.0f;
    for (int i = 0; i < columns; ++i) out[i] = static_cast<std::int8_t>((x[i] * factor + kRounder) - kRounder);
    scale[r] = most / 127.0f;
  }
}

/// A block of sums, kColumns from row to row, to `n` columns of kInt8RowBlock rows of the product, which are `stride` apart.
FBVINS_KERNEL
void rescale(const std::int32_t* sums, const float* column_scale, const float* bias, const float* row_scale, int n, float* out,
             std::ptrdiff_t stride) {
  for (int r = 0; r < kInt8RowBlock; ++r, sums += kColumns, out += stride) {
    const float* start = bias != nullptr ? bias : out;
    for (int i = 0; i < n; ++i) out[i] = static_cast<float>(sums[i]) * (row_scale[r] * column_scale[i]) + start[i];
  }
}

FBVINS_KERNEL
void subtract_whole(const float* x, const std::int8_t* whole, float unit, int n, float* out) {
  for (int i = 0; i < n; ++i) out[i] = x[i] - unit * static_cast<float>(whole[i]);
}

}  // namespace

PackedWeights pack_weights(const float* weight, int outputs, int inputs, const float* bias) {
  PackedWeights w;
  w.outputs = outputs, w.inputs = inputs;
  w.blocks.resize(static_cast<std::size_t>(outputs) * static_cast<std::size_t>(inputs));
  w.scale.resize(static_cast<std::size_t>(outputs));
  w.offset.resize(static_cast<std::size_t>(outputs));
  w.bias.assign(bias, bias + outputs);
  for (int n = 0; n < outputs; ++n) {
    const float* row = weight + static_cast<std::ptrdiff_t>(n) * inputs;
    const float most = largest_magnitude(row, inputs);
    const float factor = most > 0 ? 127.0f / most : 0.0f;
    std::int32_t sum = 0;
    for (int k = 0; k < inputs; ++k) {
      const auto q = static_cast<std::int8_t>(std::lround(row[k] * factor));
      const int place = ((n / 16) * (inputs / 4) + k / 4) * 64 + (n % 16) * 4 + k % 4;
      w.blocks[static_cast<std::size_t>(place)] = q;
      sum += q;
    }
    w.scale[static_cast<std::size_t>(n)] = most / 127.0f;
    w.offset[static_cast<std::size_t>(n)] = -128 * sum;
  }
  return w;
}

void QuantisedRows::resize(int rows, int columns) {
  count = rows, inputs = columns;
  const int padded = (rows + kInt8RowBlock - 1) / kInt8RowBlock * kInt8RowBlock;
  const auto size = static_cast<std::size_t>(padded) * static_cast<std::size_t>(columns);
  values.resize(size);
  scale.resize(static_cast<std::size_t>(padded));
  std::fill(values.begin() + static_cast<std::ptrdiff_t>(rows) * columns, values.end(), std::int8_t{0});
  std::fill(scale.begin() + rows, scale.end(), 0.0f);
}

void QuantisedRows::quantise(const float* x, int rows, int columns) {
  resize(rows, columns);
  quantise_rows(x, rows, columns, values.data(), scale.data());
}

void QuantisedRows::quantise_rest(const float* x, const QuantisedRows& coarse) {
  rest_.resize(static_cast<std::size_t>(coarse.count) * static_cast<std::size_t>(coarse.inputs));
  for (int r = 0; r < coarse.count; ++r) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(r) * coarse.inputs;
    subtract_whole(x + at, coarse.values.data() + at, coarse.scale[static_cast<std::size_t>(r)], coarse.inputs,
                   rest_.data() + at);
  }
  quantise(rest_.data(), coarse.count, coarse.inputs);
}

void QuantisedRows::set_values(const std::int8_t* whole, int rows, int columns, float unit) {
  resize(rows, columns);
  std::copy_n(whole, static_cast<std::ptrdiff_t>(rows) * columns, values.begin());
  std::fill_n(scale.begin(), rows, unit);
}

void QuantisedRows::set_signs(const std::int8_t* whole, int rows, int columns, int stride) {
  resize(rows, columns);
  for (std::ptrdiff_t r = 0; r < rows; ++r)
    std::transform(whole + r * stride, whole + r * stride + columns, values.begin() + r * columns,
                   [](std::int8_t v) { return static_cast<std::int8_t>(v > 0 ? 1 : -1); });
  std::fill_n(scale.begin(), rows, 1.0f);
}

void multiply(const QuantisedRows& rows, const PackedWeights& w, float* out, Int8Kernel kernel, Start start) {
  const auto sums_of = int8_kernel(kernel);
  alignas(64) std::int32_t sums[kInt8RowBlock * kColumns];
  for (int n = 0; n < w.outputs; n += kColumns) {
    const int blocks = std::min(kInt8BlocksTogether, (w.outputs - n) / 16);
    const std::int8_t* weights = w.blocks.data() + static_cast<std::ptrdiff_t>(n) * w.inputs;
    for (int r = 0; r < rows.count; r += kInt8RowBlock) {
      sums_of(rows.values.data() + static_cast<std::ptrdiff_t>(r) * w.inputs, weights, w.offset.data() + n, w.inputs, blocks,
              sums);
      rescale(sums, w.scale.data() + n, start == Start::from_bias ? w.bias.data() + n : nullptr,
              rows.scale.data() + static_cast<std::ptrdiff_t>(r), 16 * blocks,
              out + static_cast<std::ptrdiff_t>(r) * w.outputs + n, w.outputs);
    }
  }
}

}  // namespace fbvins
