// SPDX-License-Identifier: Apache-2.0
// On arm64 this makes Eigen run its SSE2 code, each instruction emulated with NEON (SIMDe), instead of its NEON code. Both are
// correct, but the NEON code fuses multiply-adds and sums in another order, so that a flight's result would differ from
// that on x86-64 in the last digits, and soon in more (docs/service.md).
//
// The build includes this before every source file (cmake/FbvinsModule.cmake); no file includes it itself.
#pragma once

#if defined(__aarch64__) && !defined(EIGEN_VECTORIZE_SSE2)

#define SIMDE_ENABLE_NATIVE_ALIASES
#include <simde/x86/sse2.h>

// SIMDe's macros do not accept a class that converts to a register, such as Eigen's integer packets; functions do.
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

// The only compiler builtin that Eigen uses beside the intrinsics.
#define __builtin_ia32_sqrtsd(a) _mm_set_sd(__builtin_sqrt(_mm_cvtsd_f64(a)))

// Overrides Eigen's own choice of NEON with SSE2; the alignment is the same for both.
#define EIGEN_DONT_VECTORIZE
#define EIGEN_VECTORIZE
#define EIGEN_VECTORIZE_SSE
#define EIGEN_VECTORIZE_SSE2
#define EIGEN_MAX_ALIGN_BYTES 16
#define EIGEN_MAX_STATIC_ALIGN_BYTES 16
// Eigen splits large products by the cache sizes, which it cannot query on arm64: its defaults for x86-64.
#define EIGEN_DEFAULT_L1_CACHE_SIZE (32 * 1024)
#define EIGEN_DEFAULT_L2_CACHE_SIZE (256 * 1024)
#define EIGEN_DEFAULT_L3_CACHE_SIZE (2 * 1024 * 1024)

#endif
