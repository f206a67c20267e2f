// SPDX-License-Identifier: Apache-2.0
// Uniform B-splines. Pure function.
#pragma once

#include <array>

namespace fbvins {

/// Values of the k + 1 uniform B-splines of degree k that are not zero in an interval, u in [0, 1).
/// Entry j belongs to the j-th oldest control point of the interval; the entries sum to 1.
template <int k>
std::array<double, k + 1> bspline_basis(double u) {
  std::array<double, k + 1> b{};
  b[0] = 1;
  for (int degree = 1; degree <= k; ++degree)  // Cox-de Boor for unit knots, in place from the end
    for (int j = degree; j >= 0; --j) {
      const double from_left = j > 0 ? (u + degree - j) * b[j - 1] : 0.0;
      const double from_right = j < degree ? (1 - u + j) * b[j] : 0.0;
      b[j] = (from_left + from_right) / degree;
    }
  return b;
}

}  // namespace fbvins
