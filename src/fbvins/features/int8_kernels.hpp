// SPDX-License-Identifier: Apache-2.0
// The innermost loops of int8_gemm, one function for each instruction set; all give the same integers. Pure functions.
//
//   int8_kernel(best_int8_kernel())(values, weights, offset, inputs, blocks, sums);
#pragma once

#include <cstdint>

#include "fbvins/features/int8_gemm.hpp"

namespace fbvins {

/// Blocks of sixteen outputs handled together at most.
inline constexpr int kInt8BlocksTogether = 4;

/// Sums of kInt8RowBlock rows of `inputs` values with `blocks` blocks of weights, to sums[row][kInt8BlocksTogether * 16].
/// `offset` is for kernels that shift values by 128 to make them unsigned.
using Int8Sums = void (*)(const std::int8_t* values, const std::int8_t* weights, const std::int32_t* offset, int inputs,
                          int blocks, std::int32_t* sums);

Int8Sums int8_kernel(Int8Kernel kernel);

}  // namespace fbvins
