// SPDX-License-Identifier: Apache-2.0
// On arm64 before Eigen: it runs its code for SSE2, each instruction done by NEON (SIMDe), instead of its code for NEON. Both are
// right; but the one for NEON fuses products into sums and takes them in another order, so that a flight would differ
// from x86-64 in the last digits, and soon in more (docs/board.md).
//
// The build puts this before every source (cmake/FbvinsModule.cmake); nobody includes it.
#pragma once

#if defined(__aarch64__) && !defined(EIGEN_VECTORIZE_SSE2)

#define SIMDE_ENABLE_NATIVE_ALIASES
#include <simde/x86/sse2.h>

// Where SIMDe has macros that take no class that converts to a register, as Eigen's packets of integers do.
#undef _mm_slli_epi16
#undef _mm_slli_epi32
#undef _mm_slli_epi64
#undef _mm_srli_epi16
#undef _mm_srli_epi32
#undef _mm_srli_epi64
inline __m128i _mm_slli_epi16(__m128i a, int bits) { return _mm_sll_epi16(a, _mm_cvtsi32_si128(bits)); }
inline __m128i _mm_slli_epi32(__m128i a, int bits) { return _mm_sll_epi32(a, _mm_cvtsi32_si128(bits)); }
inline __m128i _mm_slli_epi64(__m128i a, int bits) { return _mm_sll_epi64(a, _mm_cvtsi32_si128(bits)); }
inline __m128i _mm_srli_epi16(__m128i a, int bits) { return _mm_srl_epi16(a, _mm_cvtsi32_si128(bits)); }
inline __m128i _mm_srli_epi32(__m128i a, int bits) { return _mm_srl_epi32(a, _mm_cvtsi32_si128(bits)); }
inline __m128i _mm_srli_epi64(__m128i a, int bits) { return _mm_srl_epi64(a, _mm_cvtsi32_si128(bits)); }

// The one name of a compiler's own that Eigen uses beside the intrinsics.
#define __builtin_ia32_sqrtsd(a) _mm_set_sd(__builtin_sqrt(_mm_cvtsd_f64(a)))

// Not NEON by its own choice, but SSE2; with the alignment that either has.
#define EIGEN_DONT_VECTORIZE
#define EIGEN_VECTORIZE
#define EIGEN_VECTORIZE_SSE
#define EIGEN_VECTORIZE_SSE2
#define EIGEN_MAX_ALIGN_BYTES 16
#define EIGEN_MAX_STATIC_ALIGN_BYTES 16
// Large products are cut by the size of the caches, which arm64 does not tell: those that Eigen takes for x86-64.
#define EIGEN_DEFAULT_L1_CACHE_SIZE (32 * 1024)
#define EIGEN_DEFAULT_L2_CACHE_SIZE (256 * 1024)
#define EIGEN_DEFAULT_L3_CACHE_SIZE (2 * 1024 * 1024)

#endif
