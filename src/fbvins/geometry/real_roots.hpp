// SPDX-License-Identifier: Apache-2.0
// The real roots of a polynomial of small degree. Pure function, allocates nothing.
//
//   const std::array<double, 3> c{-2, 0, 1};             // x^2 - 2
//   for (const double x : real_roots(c)) use(x);         // -1.414..., 1.414...
#pragma once

#include <array>
#include <span>

namespace fbvins {

inline constexpr int kMaxDegree = 10;

struct RealRoots {
  std::array<double, kMaxDegree> value{};
  int count = 0;
  const double* begin() const { return value.data(); }
  const double* end() const { return value.data() + count; }
};

/// Roots of c[0] + c[1] x + ... + c[n] x^n, n <= kMaxDegree, at which the sign changes, to the last few bits; a root at
/// which it only touches zero may be missed by rounding. Method: between neighbouring roots of the derivative a
/// polynomial is monotonic, so that one sign change brackets one root; derivatives first, from degree one up. Roots
/// beyond +-1 are the inverses of those of the reversed polynomial within. None for the zero polynomial.
RealRoots real_roots(std::span<const double> coefficients);

}  // namespace fbvins
