// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/real_roots.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fbvins {
namespace {

using Coefficients = std::array<double, kMaxDegree + 1>;

constexpr double kBorder = 1 + 0x1p-20;  // larger roots are found as inverses; a little above 1, because 1 is a common root
constexpr int kMaxIterations = 64;       // bisection alone would need 54 to the last bit

struct ValueAndSlope {
  double value = 0, slope = 0;
};

ValueAndSlope evaluate(const Coefficients& c, int degree, double x) {
  ValueAndSlope at{c[static_cast<std::size_t>(degree)], 0};
  for (int i = degree - 1; i >= 0; --i) {
    at.slope = at.slope * x + at.value;
    at.value = at.value * x + c[static_cast<std::size_t>(i)];
  }
  return at;
}

/// The root between low and high, where the polynomial is monotonic and changes its sign: Newton steps, or bisection where
/// one would leave the bracket.
double bracketed_root(const Coefficients& c, int degree, double low, double high, double value_at_low) {
  double x = 0.5 * (low + high);
  for (int i = 0; i < kMaxIterations; ++i) {
    const ValueAndSlope at = evaluate(c, degree, x);
    if (at.value == 0) return x;
    ((at.value < 0) == (value_at_low < 0) ? low : high) = x;
    const double newton = x - at.value / at.slope;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (next == x || !(low < next && next < high)) return x;
    const bool settled = std::abs(next - x) <= 1e-16 * std::abs(x);
    x = next;
    if (settled) return x;
  }
  return x;
}

/// Roots in [-kBorder, kBorder], ascending.
RealRoots roots_within_border(const Coefficients& c, int degree) {
  RealRoots roots;
  for (int order = degree - 1; order >= 0; --order) {  // order of the derivative; 0 is the polynomial itself
    const int n = degree - order;
    Coefficients d{};
    for (int i = 0; i <= n; ++i) {
      double factor = 1;
      for (int k = 0; k < order; ++k) factor *= i + order - k;
      d[static_cast<std::size_t>(i)] = factor * c[static_cast<std::size_t>(i + order)];
    }
    RealRoots found;
    const auto add = [&](double x) {
      if (found.count < n) found.value[static_cast<std::size_t>(found.count++)] = x;
    };
    double low = -kBorder, at_low = evaluate(d, n, low).value;
    if (at_low == 0) add(low);
    for (int k = 0; k <= roots.count; ++k) {
      const double high = k < roots.count ? roots.value[static_cast<std::size_t>(k)] : kBorder;
      const double at_high = evaluate(d, n, high).value;
      if (at_high == 0) add(high);
      else if (at_low != 0 && (at_low < 0) != (at_high < 0)) add(bracketed_root(d, n, low, high, at_low));
      low = high, at_low = at_high;
    }
    roots = found;
  }
  return roots;
}

}  // namespace

RealRoots real_roots(std::span<const double> coefficients) {
  assert(!coefficients.empty() && coefficients.size() <= kMaxDegree + 1);
  const int degree = static_cast<int>(coefficients.size()) - 1;
  RealRoots roots;
  double largest = 0;
  for (const double c : coefficients) {
    if (!std::isfinite(c)) return roots;
    largest = std::max(largest, std::abs(c));
  }
  if (largest == 0) return roots;

  Coefficients scaled{}, reversed{};
  for (int i = 0; i <= degree; ++i) scaled[static_cast<std::size_t>(i)] = coefficients[static_cast<std::size_t>(i)] / largest;
  for (int i = 0; i <= degree; ++i) reversed[static_cast<std::size_t>(i)] = scaled[static_cast<std::size_t>(degree - i)];
  roots = roots_within_border(scaled, degree);
  for (const double inverse : roots_within_border(reversed, degree))
    if (std::abs(inverse) < 1 / kBorder && inverse != 0 && roots.count < degree)
      roots.value[static_cast<std::size_t>(roots.count++)] = 1 / inverse;
  return roots;
}

}  // namespace fbvins
