// SPDX-License-Identifier: Apache-2.0
// std::hypot with the same bits on every machine: glibc's differs in a tenth of its results between arm64 and x86-64. These are
// those of glibc 2.35 and later on x86-64. Pure functions.
#pragma once

#include <algorithm>
#include <cmath>

namespace fbvins {

/// sqrt(a^2 + b^2), its rounding error taken out (C. F. Borges, An improved algorithm for hypot(a, b), arXiv:1904.09481, 2019).
/// For numbers whose squares neither overflow nor underflow.
inline double hypotenuse(double a, double b) {
  const double x = std::max(std::abs(a), std::abs(b)), y = std::min(std::abs(a), std::abs(b));
  if (y <= x * 0x1p-53) return x + y;
  const double h = std::sqrt(x * x + y * y);
  double excess = 0;  // of h^2 over x^2 + y^2, from differences that are exact
  if (h <= 2 * y) {
    const double d = h - y;
    excess = x * (2 * d - x) + (d - 2 * (x - y)) * d;
  } else {
    const double d = h - x;
    excess = 2 * d * (x - 2 * y) + ((4 * d - y) * y + d * d);
  }
  return h - excess / (2 * h);
}

}  // namespace fbvins
