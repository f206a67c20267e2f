// SPDX-License-Identifier: Apache-2.0
// Lanes of numbers in vectors (of GCC and Clang) that are no wider than a register: wider ones GCC 12 keeps in memory, and
// converts and compares lane by lane. Explicit lanes let a reduction vectorise without -ffast-math, with the same bits on every
// target.
#pragma once

#include <cstring>

#include "fbvins/core/simd.hpp"

namespace fbvins {

#if defined(__x86_64__)
inline constexpr int kRegisterBytes = 32, kWideRegisterBytes = 64;  // AVX2's and AVX-512's
#else
inline constexpr int kRegisterBytes = 16, kWideRegisterBytes = 16;
#endif

template <typename T, int N, int Bytes = kRegisterBytes>
struct Lanes {
  static constexpr int kMost = Bytes / static_cast<int>(sizeof(T)), kInPart = N < kMost ? N : kMost, kParts = N / kInPart;
  static_assert(kParts * kInPart == N);
  using Part __attribute__((vector_size(kInPart * sizeof(T)))) = T;
  Part part[kParts];
};

#define FBVINS_EACH_PART _Pragma("GCC unroll 8") for (int i = 0; i < Lanes<T, N, B>::kParts; ++i)
#define FBVINS_LANES_OPERATOR(op)                                                              \
  template <typename T, int N, int B>                                                          \
  FBVINS_INLINE Lanes<T, N, B> operator op(const Lanes<T, N, B>& a, const Lanes<T, N, B>& b) { \
    Lanes<T, N, B> c;                                                                          \
    FBVINS_EACH_PART c.part[i] = a.part[i] op b.part[i];                                       \
    return c;                                                                                  \
  }                                                                                            \
  template <typename T, int N, int B>                                                          \
  FBVINS_INLINE Lanes<T, N, B> operator op(const Lanes<T, N, B>& a, T b) {                     \
    Lanes<T, N, B> c;                                                                          \
    FBVINS_EACH_PART c.part[i] = a.part[i] op b;                                               \
    return c;                                                                                  \
  }                                                                                            \
  template <typename T, int N, int B>                                                          \
  FBVINS_INLINE Lanes<T, N, B> operator op(T a, const Lanes<T, N, B>& b) {                     \
    Lanes<T, N, B> c;                                                                          \
    FBVINS_EACH_PART c.part[i] = a op b.part[i];                                               \
    return c;                                                                                  \
  }                                                                                            \
  template <typename T, int N, int B>                                                          \
  FBVINS_INLINE void operator op##=(Lanes<T, N, B>& a, const Lanes<T, N, B>& b) {              \
    FBVINS_EACH_PART a.part[i] = a.part[i] op b.part[i];                                       \
  }
FBVINS_LANES_OPERATOR(+)
FBVINS_LANES_OPERATOR(-)
FBVINS_LANES_OPERATOR(*)
FBVINS_LANES_OPERATOR(/)
#undef FBVINS_LANES_OPERATOR

// Part by part: GCC 12 copies a structure through memory.
template <typename T, int N, int B>
FBVINS_INLINE void load_lanes(const T* p, Lanes<T, N, B>& out) {
  FBVINS_EACH_PART std::memcpy(&out.part[i], p + i * Lanes<T, N, B>::kInPart, sizeof(out.part[i]));
}
template <typename T, int N, int B>
FBVINS_INLINE void store_lanes(const Lanes<T, N, B>& v, T* p) {
  FBVINS_EACH_PART std::memcpy(p + i * Lanes<T, N, B>::kInPart, &v.part[i], sizeof(v.part[i]));
}
#undef FBVINS_EACH_PART

}  // namespace fbvins
