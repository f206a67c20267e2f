// SPDX-License-Identifier: Apache-2.0
// The median of a few numbers, and the depth that is assumed for a feature without one.
//
//   std::vector<double> motion_px = ...;
//   stats.median_motion_px = median(motion_px);
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace fbvins {

/// The upper one of an even count, 0 of none. Reorders the numbers.
inline double median(std::vector<double>& numbers) {
  if (numbers.empty()) return 0;
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

/// Depth that is assumed for a feature without one: the median of the others'.
class TypicalDepth {
 public:
  /// Inverse depths matched in one image, 1/m. Reorders them. Too few are ignored.
  void update(std::vector<double>& inverse_depths) {
    constexpr std::size_t kFewest = 10;
    if (inverse_depths.size() >= kFewest) inverse_depth_ = median(inverse_depths);
  }
  double inverse_depth() const { return inverse_depth_; }

 private:
  double inverse_depth_ = 0;  // 1/m; infinitely far before the first update
};

}  // namespace fbvins
