// SPDX-License-Identifier: Apache-2.0
// The median of a few values. Pure functions, any thread.
//
//   std::vector<double> motion_px = ...;
//   stats.median_motion_px = median(motion_px);   // reorders them
//   const double typical = median_of(fits);       // of a copy
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace fbvins {

/// The upper one of an even count, T{} of none. Reorders the values.
template <class T>
T median(std::vector<T>& values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The same, of a copy.
template <class T>
T median_of(std::vector<T> values) {
  return median(values);
}

}  // namespace fbvins
