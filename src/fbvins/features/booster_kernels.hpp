// SPDX-License-Identifier: Apache-2.0
// The booster's arithmetic that is not a product of matrices. Rows are keypoints, columns channels (a multiple of 16).
// Portable loops over fixed lanes: the same bits on every machine. Pure functions.
#pragma once

#include <cstdint>

namespace fbvins {

/// out[row][n] = sum_k x[row][k] weight[n][k] + bias[n], in order of k; weight_t is [inputs][outputs].
void multiply_float(const float* x, int rows, int inputs, const float* weight_t, const float* bias, int outputs, float* out);

void relu(float* x, int n);

/// x += y
void add(float* x, const float* y, int n);

/// Each row to mean 0 and variance 1, then times weight plus bias.
void normalise_rows(float* x, int rows, int width, const float* weight, const float* bias);

/// summary[c] = sum_row softmax_row(key[row][c]) value[row][c] (eq. 7-8); scratch holds 2 * width numbers.
void summarise(float* key, const float* value, int rows, int width, float* summary, float* scratch);

/// out[row][c] = sigmoid(query[row][c]) summary[c]
void gate(const float* query, const float* summary, int rows, int width, float* out);

/// The signs of 256 numbers as bits (y > 0).
void take_signs(const float* y, std::uint64_t* out);

}  // namespace fbvins
