// SPDX-License-Identifier: Apache-2.0
// Percentiles of a latency in fixed memory, for flights of hours: bins 2 % wide. Any thread.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "fbvins/live/live_event.hpp"

namespace fbvins {

class LatencyHistogram {
 public:
  void add(Duration latency) {
    const double ms = std::max(0.0, latency.seconds() * 1e3);
    const std::lock_guard lock(mutex_);
    ++bins_[bin_of(ms)];
    ++count_;
    max_ms_ = std::max(max_ms_, ms);
  }

  LatencySummary summary() const {
    const std::lock_guard lock(mutex_);
    return {percentile(0.50), percentile(0.99), max_ms_, count_};
  }

 private:
  static constexpr double kSmallest_ms = 0.01, kStep = 1.02;
  static constexpr int kBins = 1000;  // up to an hour

  static std::size_t bin_of(double ms) {
    if (ms <= kSmallest_ms) return 0;
    return static_cast<std::size_t>(
        std::clamp(1 + static_cast<int>(std::log(ms / kSmallest_ms) / std::log(kStep)), 0, kBins - 1));
  }
  /// The upper end of the bin that holds this quantile.
  double percentile(double share) const {
    if (count_ == 0) return 0;
    std::int64_t below = 0;
    for (int k = 0; k < kBins; ++k) {
      below += bins_[static_cast<std::size_t>(k)];
      if (static_cast<double>(below) >= share * static_cast<double>(count_))
        return std::min(max_ms_, kSmallest_ms * std::pow(kStep, k));
    }
    return max_ms_;
  }

  mutable std::mutex mutex_;
  std::array<std::int64_t, kBins> bins_{};
  std::int64_t count_ = 0;
  double max_ms_ = 0;
};

}  // namespace fbvins
