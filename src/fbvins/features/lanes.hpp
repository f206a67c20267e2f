// SPDX-License-Identifier: Apache-2.0
// Sixteen float lanes: from bytes, and their sum.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "fbvins/core/lanes.hpp"

#if defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace fbvins {

inline constexpr int kLanes = 16;
using F16 = Lanes<float, kLanes>;
using U8x16 = std::uint8_t __attribute__((vector_size(16)));

/// Bytes to lanes. Sixteen bytes are read, however many lanes there are.
template <int N, int B>
FBVINS_INLINE void load_lanes(const std::uint8_t* p, Lanes<float, N, B>& out) {
  constexpr int kInPart = Lanes<float, N, B>::kInPart;
#if defined(__aarch64__)
  const uint8x16_t bytes = vld1q_u8(p);
#pragma GCC unroll 4
  for (int i = 0; i < N / kInPart; ++i) {
    // Four bytes to the lowest places of four numbers; a place beyond the table gives zero.
    const auto first = static_cast<std::uint32_t>(kInPart * i);
    const uint32x4_t places = {0xffffff00 + first, 0xffffff01 + first, 0xffffff02 + first, 0xffffff03 + first};
    out.part[i] = vcvtq_f32_u32(vreinterpretq_u32_u8(vqtbl1q_u8(bytes, vreinterpretq_u8_u32(places))));
  }
#else
  // Widened in steps of two: GCC 12 falls back to scalars for a step of four.
  using U16x16 = std::uint16_t __attribute__((vector_size(32)));
  U8x16 bytes;
  std::memcpy(&bytes, p, sizeof(bytes));
  const U16x16 wide = __builtin_convertvector(bytes, U16x16);
#pragma GCC unroll 4
  for (int i = 0; i < N / kInPart; ++i) {
    typename Lanes<std::uint16_t, kInPart, B>::Part part;
    std::memcpy(&part, reinterpret_cast<const char*>(&wide) + i * sizeof(part), sizeof(part));
    out.part[i] = __builtin_convertvector(__builtin_convertvector(part, typename Lanes<std::int32_t, kInPart, B>::Part),
                                          typename Lanes<float, N, B>::Part);
  }
#endif
}

/// Sum of the lanes, pairwise: the upper half is added to the lower one, and so on.
template <int N, int B>
FBVINS_INLINE float sum_lanes(const Lanes<float, N, B>& v) {
  using Four = float __attribute__((vector_size(16)));
  constexpr int kFours = N / 4, kInPart = Lanes<float, N, B>::kInPart / 4;
  Four s[kFours];
#pragma GCC unroll 4
  for (int i = 0; i < kFours; ++i)
    std::memcpy(&s[i], reinterpret_cast<const char*>(&v.part[i / kInPart]) + i % kInPart * sizeof(Four), sizeof(Four));
#pragma GCC unroll 4
  for (int half = kFours / 2; half > 0; half /= 2)
#pragma GCC unroll 4
    for (int i = 0; i < half; ++i) s[i] += s[i + half];
  return (s[0][0] + s[0][2]) + (s[0][1] + s[0][3]);
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
