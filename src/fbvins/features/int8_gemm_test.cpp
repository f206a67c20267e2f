// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/int8_gemm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/int8_kernels.hpp"

namespace fbvins {
namespace int8_gemm_test {

std::vector<float> random_numbers(std::size_t count, float spread, Rng& rng) {
  std::vector<float> out(count);
  for (float& v : out) v = spread * static_cast<float>(rng.normal());
  return out;
}

struct Shape {
  int rows, inputs, outputs;
};

/// Integer weights, the largest of each row 127: packing does not round them.
std::vector<float> whole_weights(int outputs, int inputs, Rng& rng) {
  std::vector<float> out(static_cast<std::size_t>(outputs * inputs));
  for (float& v : out) v = static_cast<float>(static_cast<int>(rng.below(255)) - 127);
  for (int n = 0; n < outputs; ++n) out[static_cast<std::size_t>(n * inputs)] = 127;
  return out;
}

TEST(QuantisedRows, TheirRestMakesProductsAHundredTimesFiner) {
  constexpr int kRows = 7, kInputs = 64, kOutputs = 32;
  Rng rng(6);
  const std::vector<float> x = random_numbers(kRows * kInputs, 3.0f, rng), bias = random_numbers(kOutputs, 1.0f, rng);
  const std::vector<float> weight = whole_weights(kOutputs, kInputs, rng);
  const PackedWeights packed = pack_weights(weight.data(), kOutputs, kInputs, bias.data());
  QuantisedRows coarse, rest;
  coarse.quantise(x.data(), kRows, kInputs);
  rest.quantise_rest(x.data(), coarse);
  std::vector<float> out(2 * kInt8RowBlock * kOutputs);
  const auto worst = [&] {
    double most = 0;
    for (int r = 0; r < kRows; ++r)
      for (int n = 0; n < kOutputs; ++n) {
        double exact = bias[static_cast<std::size_t>(n)];
        for (int k = 0; k < kInputs; ++k)
          exact += double{x[static_cast<std::size_t>(r * kInputs + k)]} * weight[static_cast<std::size_t>(n * kInputs + k)];
        most = std::max(most, std::abs(out[static_cast<std::size_t>(r * kOutputs + n)] - exact));
      }
    return most;
  };
  multiply(coarse, packed, out.data(), Int8Kernel::portable);
  const double with_one = worst();
  multiply(rest, packed, out.data(), Int8Kernel::portable, Start::from_output);
  EXPECT_LT(worst(), with_one / 100);
}

class Products : public testing::TestWithParam<Shape> {
 protected:
  void SetUp() override {
    const auto [rows, inputs, outputs] = GetParam();
    Rng rng(5);
    x = random_numbers(static_cast<std::size_t>(rows * inputs), 3.0f, rng);
    weight = random_numbers(static_cast<std::size_t>(outputs * inputs), 0.1f, rng);
    bias = random_numbers(static_cast<std::size_t>(outputs), 1.0f, rng);
    packed = pack_weights(weight.data(), outputs, inputs, bias.data());
    quantised.quantise(x.data(), rows, inputs);
  }

  std::vector<float> product(Int8Kernel kernel) {
    const auto [rows, inputs, outputs] = GetParam();
    const int padded = (rows + kInt8RowBlock - 1) / kInt8RowBlock * kInt8RowBlock;
    std::vector<float> out(static_cast<std::size_t>(padded * outputs), -1.0f);
    multiply(quantised, packed, out.data(), kernel);
    out.resize(static_cast<std::size_t>(rows * outputs));
    return out;
  }

  std::vector<float> x, weight, bias;
  PackedWeights packed;
  QuantisedRows quantised;
};

TEST_P(Products, OfAllKernelsHaveTheSameBits) {
  const auto [rows, inputs, outputs] = GetParam();
  // As they are, hardly negative, and not negative as behind a rectifier.
  for (const float lowest : {-10.0f, -0.1f, 0.0f}) {
    for (float& value : x) value = std::max(value, lowest);
    quantised.quantise(x.data(), rows, inputs);
    const std::vector<float> expected = product(Int8Kernel::portable);
    int others = 0;
    for (const Int8Kernel kernel : {Int8Kernel::avx2, Int8Kernel::avx512_vnni, Int8Kernel::neon_dot}) {
      if (!int8_kernel_works(kernel)) continue;
      EXPECT_EQ(product(kernel), expected) << name_of(kernel) << ' ' << lowest;
      ++others;
    }
    if (others == 0) GTEST_SKIP() << "this processor has the portable kernel only";
  }
}

TEST_P(Products, AreThoseOfRealNumbersToAPercent) {
  const auto [rows, inputs, outputs] = GetParam();
  const std::vector<float> got = product(best_int8_kernel());
  double error2 = 0, size2 = 0;
  for (int r = 0; r < rows; ++r)
    for (int n = 0; n < outputs; ++n) {
      double sum = bias[static_cast<std::size_t>(n)];
      for (int k = 0; k < inputs; ++k)
        sum +=
            static_cast<double>(x[static_cast<std::size_t>(r * inputs + k)]) * weight[static_cast<std::size_t>(n * inputs + k)];
      error2 += std::pow(sum - got[static_cast<std::size_t>(r * outputs + n)], 2);
      size2 += sum * sum;
    }
  EXPECT_LT(std::sqrt(error2 / size2), 0.015);
}

INSTANTIATE_TEST_SUITE_P(Shapes, Products,
                         testing::Values(Shape{1, 16, 16}, Shape{7, 32, 64}, Shape{13, 256, 80}, Shape{30, 64, 128},
                                         Shape{6, 512, 48}, Shape{12, 128, 96}),
                         [](const auto& row) {
                           return std::to_string(row.param.rows) + "x" + std::to_string(row.param.inputs) + "x" +
                                  std::to_string(row.param.outputs);
                         });

TEST(Int8Kernels, AgreeAtTheLargestValues) {
  constexpr int kInputs = 1024, kBlocks = 4;
  std::vector<std::int8_t> values(kInt8RowBlock * kInputs), weights(16 * kBlocks * kInputs);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = i % 3 == 0 ? std::int8_t{-127} : std::int8_t{127};
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = i % 5 == 0 ? std::int8_t{-127} : std::int8_t{127};
  std::vector<std::int32_t> offset(16 * kBlocks), expected(kInt8RowBlock * 64), got(kInt8RowBlock * 64);
  for (int b = 0; b < kBlocks; ++b)
    for (int g = 0; g < kInputs / 4; ++g)
      for (int i = 0; i < 64; ++i)
        offset[static_cast<std::size_t>(16 * b + i / 4)] -=
            128 * weights[static_cast<std::size_t>(b * 16 * kInputs + 64 * g + i)];
  int8_kernel(Int8Kernel::portable)(values.data(), weights.data(), offset.data(), kInputs, kBlocks, expected.data());
  for (const Int8Kernel kernel : {Int8Kernel::avx2, Int8Kernel::avx512_vnni, Int8Kernel::neon_dot}) {
    if (!int8_kernel_works(kernel)) continue;
    int8_kernel(kernel)(values.data(), weights.data(), offset.data(), kInputs, kBlocks, got.data());
    EXPECT_EQ(got, expected) << name_of(kernel);
  }
}

TEST(QuantisedRows, KeepWholeNumbersSignsAndZerosExactly) {
  const std::vector<std::int8_t> whole = {-127, -1, 0, 1, 127, 5, 0, -3};
  QuantisedRows rows;
  rows.set_values(whole.data(), 2, 4, 0.25f);
  EXPECT_TRUE(std::equal(whole.begin(), whole.end(), rows.values.begin()));
  EXPECT_EQ(rows.scale[1], 0.25f);
  rows.set_signs(whole.data(), 1, 8, 8);
  const std::vector<std::int8_t> signs = {-1, -1, -1, 1, 1, 1, -1, -1};
  EXPECT_TRUE(std::equal(signs.begin(), signs.end(), rows.values.begin()));
  EXPECT_EQ(rows.scale[0], 1.0f);
  const std::vector<float> zeros(32, 0.0f);
  rows.quantise(zeros.data(), 2, 16);
  EXPECT_EQ(rows.scale[0], 0.0f);
  EXPECT_TRUE(std::all_of(rows.values.begin(), rows.values.end(), [](std::int8_t v) { return v == 0; }));
}

}  // namespace int8_gemm_test
}  // namespace fbvins
