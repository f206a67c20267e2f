// SPDX-License-Identifier: Apache-2.0
// This machine's clock, CLOCK_MONOTONIC.
#pragma once

#include <ctime>

#include "fbvins/core/time.hpp"

namespace fbvins {

inline Time host_now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return {t.tv_sec * 1'000'000'000LL + t.tv_nsec};
}

}  // namespace fbvins
