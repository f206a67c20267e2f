// SPDX-License-Identifier: Apache-2.0
// The period of a stream of stamps: the median of the last intervals, robust against a few missing or late ones.
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "fbvins/core/time.hpp"

namespace fbvins {

class SamplePeriod {
 public:
  void add(Duration interval) {
    if (interval.ns <= 0) return;
    intervals_[count_++ % intervals_.size()] = interval;
  }

  /// None before three intervals are known.
  std::optional<Duration> median() const {
    if (count_ < 3) return std::nullopt;
    auto sorted = intervals_;
    const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(count_, sorted.size()));
    const auto middle = sorted.begin() + (end - sorted.begin()) / 2;
    std::nth_element(sorted.begin(), middle, end);
    return *middle;
  }

 private:
  std::array<Duration, 15> intervals_{};
  std::size_t count_ = 0;
};

}  // namespace fbvins
