// SPDX-License-Identifier: Apache-2.0
// Products of a matrix with fixed weights in 8-bit integers: each row of the matrix is scaled to -127..127 by its largest
// magnitude, the weights of each output once, when they are packed, and sums of products are exact 32-bit integers.
// So the kernels (AVX-512 VNNI, AVX2, NEON dot product, portable; chosen at run time) give the same bits.
// Weights are read-only after packing; one QuantisedRows a thread; nothing is allocated once buffers have grown.
//
//   PackedWeights w = pack_weights(weight.data(), outputs, inputs, bias.data());
//   rows.quantise(x, count, inputs);
//   multiply(rows, w, out);                          // out[row * w.outputs + n] = x W^T + bias
#pragma once

#include <cstdint>
#include <vector>

namespace fbvins {

enum class Int8Kernel { portable, avx2, avx512_vnni, neon_dot };

/// The fastest this processor has.
Int8Kernel best_int8_kernel();
bool int8_kernel_works(Int8Kernel kernel);
const char* name_of(Int8Kernel kernel);

/// Weights in blocks of sixteen outputs by four inputs.
struct PackedWeights {
  int outputs = 0;                   ///< multiple of 16
  int inputs = 0;                    ///< multiple of 4
  std::vector<std::int8_t> blocks;   ///< [outputs / 16][inputs / 4][16][4]
  std::vector<float> scale, bias;    ///< of each output
  std::vector<std::int32_t> offset;  ///< -128 times the sum of each output's weights
};

/// weight is [outputs][inputs], row-major.
PackedWeights pack_weights(const float* weight, int outputs, int inputs, const float* bias);

class QuantisedRows {
 public:
  /// x is [count][inputs], inputs a multiple of 4.
  void quantise(const float* x, int count, int inputs);
  /// Quantises the rounding error that `coarse`, which was made of x, has left.
  void quantise_rest(const float* x, const QuantisedRows& coarse);
  /// Takes integers as they are, [count][inputs], each standing for that many `unit`; exact.
  void set_values(const std::int8_t* whole, int count, int inputs, float unit);
  /// Takes +1 for numbers above zero and -1 for the others; exact. Rows begin `stride` numbers apart.
  void set_signs(const std::int8_t* whole, int count, int inputs, int stride);

  int count = 0, inputs = 0;
  std::vector<std::int8_t> values;  ///< [count rounded up][inputs], rows past count are zero
  std::vector<float> scale;         ///< of each row

 private:
  void resize(int rows, int columns);
  std::vector<float> rest_;
};

/// Rows handled together by a kernel: values are padded to a multiple. With four rows of four columns the sums stay in
/// sixteen registers; 24 of them run at half the speed (AVX-512 VNNI on Zen 4: 105 against 218 products a nanosecond).
inline constexpr int kInt8RowBlock = 4;

/// What the products are added to.
enum class Start { from_bias, from_output };

/// out is [rows.count rounded up to kInt8RowBlock][w.outputs].
void multiply(const QuantisedRows& rows, const PackedWeights& w, float* out, Int8Kernel kernel, Start start = Start::from_bias);

}  // namespace fbvins
