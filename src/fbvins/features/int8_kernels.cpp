// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/int8_kernels.hpp"

#include <cstring>

#include "fbvins/core/simd.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__) && defined(__linux__)
#include <arm_neon.h>
#include <sys/auxv.h>
#endif

namespace fbvins {
namespace {

constexpr int kRows = kInt8RowBlock, kTogether = kInt8BlocksTogether;

FBVINS_KERNEL
void sums_portable(const std::int8_t* values, const std::int8_t* weights, const std::int32_t*, int inputs, int blocks,
                   std::int32_t* sums) {
  for (int block = 0; block < blocks; ++block) {
    const std::int8_t* w = weights + block * 16 * inputs;
    for (int row = 0; row < kRows; ++row) {
      const std::int8_t* a = values + row * inputs;
      std::int32_t sum[16] = {};
      for (int g = 0; g < inputs / 4; ++g)
        for (int n = 0; n < 16; ++n)
          sum[n] += a[4 * g] * w[64 * g + 4 * n] + a[4 * g + 1] * w[64 * g + 4 * n + 1] + a[4 * g + 2] * w[64 * g + 4 * n + 2] +
                    a[4 * g + 3] * w[64 * g + 4 * n + 3];
      std::memcpy(sums + row * 16 * kTogether + 16 * block, sum, sizeof(sum));
    }
  }
}

#if defined(__x86_64__)

std::int32_t four_bytes(const std::int8_t* p) {
  std::int32_t v;
  std::memcpy(&v, p, 4);
  return v;
}

/// |a| times (w with a's sign): vpmaddubsw takes an unsigned and a signed factor, and 2 * 127 * 127 fits its 16 bits. Without
/// `Signs` no value is negative.
template <int Blocks, bool Signs>
__attribute__((target("avx2"))) void sums_avx2_of(const std::int8_t* values, const std::int8_t* weights, int inputs,
                                                  std::int32_t* sums) {
  const __m256i ones = _mm256_set1_epi16(1);
  for (int first = 0; first < kRows; first += 2) {
    __m256i sum[2][2 * Blocks];
    for (auto& row : sum)
      for (__m256i& s : row) s = _mm256_setzero_si256();
    for (int g = 0; g < inputs / 4; ++g) {
      __m256i a[2], magnitude[2];
      for (int r = 0; r < 2; ++r) {
        a[r] = _mm256_set1_epi32(four_bytes(values + (first + r) * inputs + 4 * g));
        magnitude[r] = Signs ? _mm256_abs_epi8(a[r]) : a[r];
      }
      for (int b = 0; b < Blocks; ++b)
        for (int half = 0; half < 2; ++half) {
          const __m256i w = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(weights + b * 16 * inputs + 64 * g + 32 * half));
          for (int r = 0; r < 2; ++r) {
            const __m256i pairs = _mm256_maddubs_epi16(magnitude[r], Signs ? _mm256_sign_epi8(w, a[r]) : w);
            sum[r][2 * b + half] = _mm256_add_epi32(sum[r][2 * b + half], _mm256_madd_epi16(pairs, ones));
          }
        }
    }
    for (int r = 0; r < 2; ++r)
      for (int i = 0; i < 2 * Blocks; ++i)
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + (first + r) * 16 * kTogether + 8 * i), sum[r][i]);
  }
}

/// Behind a rectifier none is.
__attribute__((target("avx2"))) bool any_negative(const std::int8_t* values, int count) {
  __m256i all = _mm256_setzero_si256();
  int i = 0;
  for (; i + 32 <= count; i += 32) all = _mm256_or_si256(all, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(values + i)));
  bool negative = _mm256_movemask_epi8(all) != 0;
  for (; i < count; ++i) negative = negative || values[i] < 0;
  return negative;
}

template <bool Signs>
__attribute__((target("avx2"))) void sums_avx2_in_twos(const std::int8_t* values, const std::int8_t* weights, int inputs,
                                                       int blocks, std::int32_t* sums) {
  for (int b = 0; b < blocks; b += 2) {
    const std::int8_t* w = weights + b * 16 * inputs;
    if (b + 2 <= blocks) sums_avx2_of<2, Signs>(values, w, inputs, sums + 16 * b);
    else sums_avx2_of<1, Signs>(values, w, inputs, sums + 16 * b);
  }
}

__attribute__((target("avx2"))) void sums_avx2(const std::int8_t* values, const std::int8_t* weights, const std::int32_t*,
                                               int inputs, int blocks, std::int32_t* sums) {
  // Early values of either sign, as most rows have, answer for the rest.
  const int few = inputs < 32 ? inputs : 32;
  if (any_negative(values, few) || any_negative(values, kRows * inputs))
    sums_avx2_in_twos<true>(values, weights, inputs, blocks, sums);
  else sums_avx2_in_twos<false>(values, weights, inputs, blocks, sums);
}

#define FBVINS_VNNI __attribute__((target("avx512f,avx512bw,avx512vnni")))

/// sum += a (unsigned bytes) . w (signed bytes), four at a time. In assembly, because GCC 12 copies each sum twice around the
/// intrinsic and spills it to memory.
#define FBVINS_ADD_PRODUCTS(sum, a, w) __asm__("vpdpbusd %2, %1, %0" : "+v"(sum) : "v"(a), "v"(w))

template <int Blocks>
FBVINS_VNNI void sums_vnni_of(const std::int8_t* values, const std::int8_t* weights, const std::int32_t* offset, int inputs,
                              std::int32_t* sums) {
  static_assert(kRows == 4);
  const __m512i sign = _mm512_set1_epi8(static_cast<char>(0x80));
  __m512i sum0[Blocks], sum1[Blocks], sum2[Blocks], sum3[Blocks];
#pragma GCC unroll 4
  for (int b = 0; b < Blocks; ++b) sum0[b] = sum1[b] = sum2[b] = sum3[b] = _mm512_loadu_si512(offset + 16 * b);
  for (int g = 0; g < inputs / 4; ++g) {
    __m512i a[kRows];
#pragma GCC unroll 4
    for (int r = 0; r < kRows; ++r)
      a[r] = _mm512_xor_si512(_mm512_set1_epi32(four_bytes(values + r * inputs + 4 * g)), sign);  // plus 128
#pragma GCC unroll 4
    for (int b = 0; b < Blocks; ++b) {
      const __m512i w = _mm512_loadu_si512(weights + b * 16 * inputs + 64 * g);
      FBVINS_ADD_PRODUCTS(sum0[b], a[0], w);
      FBVINS_ADD_PRODUCTS(sum1[b], a[1], w);
      FBVINS_ADD_PRODUCTS(sum2[b], a[2], w);
      FBVINS_ADD_PRODUCTS(sum3[b], a[3], w);
    }
  }
#pragma GCC unroll 4
  for (int b = 0; b < Blocks; ++b) {
    _mm512_storeu_si512(sums + 16 * b, sum0[b]);
    _mm512_storeu_si512(sums + 16 * kTogether + 16 * b, sum1[b]);
    _mm512_storeu_si512(sums + 2 * 16 * kTogether + 16 * b, sum2[b]);
    _mm512_storeu_si512(sums + 3 * 16 * kTogether + 16 * b, sum3[b]);
  }
}

FBVINS_VNNI void sums_vnni(const std::int8_t* values, const std::int8_t* weights, const std::int32_t* offset, int inputs,
                           int blocks, std::int32_t* sums) {
  switch (blocks) {
    case 4: return sums_vnni_of<4>(values, weights, offset, inputs, sums);
    case 3: return sums_vnni_of<3>(values, weights, offset, inputs, sums);
    case 2: return sums_vnni_of<2>(values, weights, offset, inputs, sums);
    default: return sums_vnni_of<1>(values, weights, offset, inputs, sums);
  }
}

#elif defined(__aarch64__) && defined(__linux__)

#define FBVINS_DOT __attribute__((target("arch=armv8.2-a+dotprod")))

/// Adds to the sums of each row the products of the inputs 4 * (g + lane) on; `a` has sixteen inputs of each row, from 4 * g on.
template <int Lane>
FBVINS_DOT FBVINS_INLINE void add_products(const std::int8_t* weights, const int8x16_t (&a)[kRows], int32x4_t (&sum)[kRows][4]) {
  const int8x16_t w[4] = {vld1q_s8(weights), vld1q_s8(weights + 16), vld1q_s8(weights + 32), vld1q_s8(weights + 48)};
#pragma GCC unroll 4
  for (int r = 0; r < kRows; ++r)
#pragma GCC unroll 4
    for (int i = 0; i < 4; ++i) sum[r][i] = vdotq_laneq_s32(sum[r][i], w[i], a[r], Lane);
}

FBVINS_DOT void sums_neon(const std::int8_t* values, const std::int8_t* weights, const std::int32_t*, int inputs, int blocks,
                          std::int32_t* sums) {
  for (int block = 0; block < blocks; ++block) {
    const std::int8_t* w = weights + block * 16 * inputs;
    int32x4_t sum[kRows][4];
    for (auto& row : sum)
      for (int32x4_t& s : row) s = vdupq_n_s32(0);
    int8x16_t a[kRows];
    int k = 0;
    for (; k + 16 <= inputs; k += 16, w += 256) {
      for (int r = 0; r < kRows; ++r) a[r] = vld1q_s8(values + r * inputs + k);
      add_products<0>(w, a, sum);
      add_products<1>(w + 64, a, sum);
      add_products<2>(w + 128, a, sum);
      add_products<3>(w + 192, a, sum);
    }
    for (; k < inputs; k += 4, w += 64) {
      for (int r = 0; r < kRows; ++r) {
        std::int32_t four;
        std::memcpy(&four, values + r * inputs + k, 4);
        a[r] = vreinterpretq_s8_s32(vdupq_n_s32(four));
      }
      add_products<0>(w, a, sum);
    }
    for (int r = 0; r < kRows; ++r)
      for (int i = 0; i < 4; ++i) vst1q_s32(sums + r * 16 * kTogether + 16 * block + 4 * i, sum[r][i]);
  }
}

#endif

}  // namespace

bool int8_kernel_works(Int8Kernel kernel) {
#if defined(__x86_64__)
  if (kernel == Int8Kernel::avx512_vnni)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vnni");
  if (kernel == Int8Kernel::avx2) return __builtin_cpu_supports("avx2");
#elif defined(__aarch64__) && defined(__linux__)
  if (kernel == Int8Kernel::neon_dot) return (getauxval(AT_HWCAP) & HWCAP_ASIMDDP) != 0;
#endif
  return kernel == Int8Kernel::portable;
}

Int8Kernel best_int8_kernel() {
  for (const Int8Kernel kernel : {Int8Kernel::avx512_vnni, Int8Kernel::avx2, Int8Kernel::neon_dot})
    if (int8_kernel_works(kernel)) return kernel;
  return Int8Kernel::portable;
}

const char* name_of(Int8Kernel kernel) {
  switch (kernel) {
    case Int8Kernel::avx2: return "AVX2";
    case Int8Kernel::avx512_vnni: return "AVX-512 VNNI";
    case Int8Kernel::neon_dot: return "NEON dot product";
    default: return "portable";
  }
}

Int8Sums int8_kernel(Int8Kernel kernel) {
#if defined(__x86_64__)
  if (kernel == Int8Kernel::avx512_vnni) return sums_vnni;
  if (kernel == Int8Kernel::avx2) return sums_avx2;
#elif defined(__aarch64__) && defined(__linux__)
  if (kernel == Int8Kernel::neon_dot) return sums_neon;
#endif
  return sums_portable;
}

}  // namespace fbvins
