// SPDX-License-Identifier: Apache-2.0
// Sixteen float lanes (a GCC/Clang vector type, lowered to whatever registers the target has).
// Explicit lanes let a reduction vectorise without -ffast-math, with the same bits on every target.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "fbvins/core/simd.hpp"

namespace fbvins {

inline constexpr int kLanes = 16;
using F16 = float __attribute__((vector_size(64)));
using I16 = std::int32_t __attribute__((vector_size(64)));
using U16x16 = std::uint16_t __attribute__((vector_size(32)));
using U8x16 = std::uint8_t __attribute__((vector_size(16)));

FBVINS_INLINE void load_lanes(const std::uint8_t* p, F16& out) {
  U8x16 bytes;
  std::memcpy(&bytes, p, sizeof(bytes));
  // Widened in steps of two: GCC 12 falls back to scalars for a step of four.
  out = __builtin_convertvector(__builtin_convertvector(__builtin_convertvector(bytes, U16x16), I16), F16);
}

FBVINS_INLINE void load_lanes(const float* p, F16& out) { std::memcpy(&out, p, sizeof(out)); }
FBVINS_INLINE void store_lanes(const F16& v, float* p) { std::memcpy(p, &v, sizeof(v)); }

/// Sum of the lanes, pairwise in a fixed order.
FBVINS_INLINE float sum_lanes(const F16& v) {
  float a[kLanes];
  std::memcpy(a, &v, sizeof(v));
  for (int half = kLanes / 2; half > 0; half /= 2)
    for (int i = 0; i < half; ++i) a[i] += a[i + half];
  return a[0];
}

/// 256 flags, each 0 or 1, as bits: the first in the lowest of the first word.
FBVINS_INLINE void pack_flags(const std::uint8_t* flags, std::uint64_t* words) {
  static_assert(std::endian::native == std::endian::little, "the lowest byte must be the first flag");
  for (int word = 0; word < 4; ++word) {
    std::uint64_t bits = 0;
    for (int byte = 0; byte < 8; ++byte, flags += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, flags, sizeof(eight));
      bits |= ((eight * 0x0102040810204080) >> 56) << (8 * byte);  // flag i of the eight comes to bit 56 + i
    }
    words[word] = bits;
  }
}

}  // namespace fbvins
