/* SPDX-License-Identifier: Apache-2.0 */
/* glibc 2.29 gave these functions a second version, without an error handler that C++ does not use. The first one computes the same,
   and is in glibc 2.28, too. */
#if !defined(FBVINS_WHEEL_SYMBOLS_H) && !defined(__ASSEMBLER__)
#define FBVINS_WHEEL_SYMBOLS_H
#ifdef __aarch64__
#define FIRST "GLIBC_2.17"
#else
#define FIRST "GLIBC_2.2.5"
#endif
__asm__(".symver exp,exp@" FIRST);
__asm__(".symver exp2,exp2@" FIRST);
__asm__(".symver log,log@" FIRST);
__asm__(".symver log2,log2@" FIRST);
__asm__(".symver pow,pow@" FIRST);
#undef FIRST
#endif
