/* SPDX-License-Identifier: Apache-2.0 */
/* glibc 2.29 gave these functions a second version, without an error handler that C++ does not use. The first one computes the same,
   and is in glibc 2.28, too. */
#ifndef FBVINS_WHEEL_SYMBOLS_H
#define FBVINS_WHEEL_SYMBOLS_H
__asm__(".symver exp,exp@GLIBC_2.2.5");
__asm__(".symver exp2,exp2@GLIBC_2.2.5");
__asm__(".symver log,log@GLIBC_2.2.5");
__asm__(".symver log2,log2@GLIBC_2.2.5");
__asm__(".symver pow,pow@GLIBC_2.2.5");
#endif
