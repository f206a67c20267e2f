// SPDX-License-Identifier: Apache-2.0
// The depth that is assumed for a feature without one. A value.
#pragma once

#include <cstddef>
#include <vector>

#include "fbvins/core/median.hpp"

namespace fbvins {

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
