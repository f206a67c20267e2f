/* SPDX-License-Identifier: Apache-2.0 */
/* What this machine's static libstdc++ expects of its own C library, and an older one lacks: part of each wheel's module. */
#include <sys/random.h>

#define HIDDEN __attribute__((visibility("hidden")))

/* glibc 2.32: whether there is one thread only. There may always be more. */
HIDDEN char __libc_single_threaded = 0;

/* glibc 2.36: for std::random_device. */
HIDDEN unsigned int arc4random(void) {
  unsigned int number = 0;
  while (getrandom(&number, sizeof number, 0) != (ssize_t)sizeof number) {
  }
  return number;
}
