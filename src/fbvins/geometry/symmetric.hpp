// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of small symmetric matrices in closed form.
#pragma once

#include <cmath>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// The larger eigenvalue: of a covariance, the variance along its worst direction.
inline double largest_eigenvalue(const Mat2& symmetric) {
  const double mean = 0.5 * (symmetric(0, 0) + symmetric(1, 1)), half = 0.5 * (symmetric(0, 0) - symmetric(1, 1));
  return mean + std::sqrt(half * half + symmetric(1, 0) * symmetric(1, 0));  // not std::hypot: its bits differ between machines
}

}  // namespace fbvins
