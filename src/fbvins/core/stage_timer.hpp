// SPDX-License-Identifier: Apache-2.0
// CPU time of the calling thread, for the Stats values that stages return. Never steers an algorithm.
#pragma once

#include <ctime>

namespace fbvins {

/// Milliseconds of CPU time used by this thread since construction or the last lap().
class CpuTimer {
 public:
  CpuTimer() : start_ns_(now_ns()) {}

  double lap_ms() {
    const long long now = now_ns();
    const double ms = static_cast<double>(now - start_ns_) * 1e-6;
    start_ns_ = now;
    return ms;
  }

 private:
  static long long now_ns() {
    timespec ts{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &ts);
    return ts.tv_sec * 1'000'000'000LL + ts.tv_nsec;
  }
  long long start_ns_;
};

}  // namespace fbvins
