// SPDX-License-Identifier: Apache-2.0
// Run-time dispatch for hot kernels. FBVINS_KERNEL before a function compiles it once for the
// baseline and, on x86-64, once more for AVX2 and AVX-512 machines; the loader picks one.
// Kernels are plain portable loops over fixed lanes, so every copy gives the same bits
// (the build forbids contraction to fused multiply-add).
#pragma once

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if defined(__clang__)
#if __clang_major__ >= 14 && !__has_feature(address_sanitizer) && !__has_feature(thread_sanitizer)
#define FBVINS_KERNEL __attribute__((target_clones("avx2", "default")))
#endif
#elif __GNUC__ < 12  // does not know the x86-64-v3 and -v4 levels
#define FBVINS_KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FBVINS_KERNEL __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#endif
#endif

#ifndef FBVINS_KERNEL
#define FBVINS_KERNEL
#endif

/// For helpers of kernels: without inlining they would be compiled for the baseline only.
#define FBVINS_INLINE inline __attribute__((always_inline))

/// Whether kernels that are written for both widths of registers take the wider one.
FBVINS_INLINE bool has_wide_registers() {
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__)
  return __builtin_cpu_supports("avx512f");
#else
  return false;
#endif
}
