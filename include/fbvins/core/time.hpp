// SPDX-License-Identifier: Apache-2.0
// Time of the data: int64 nanoseconds, never a double, never a wall clock.
//
//   Time t{1'403'636'584'763'555'584};
//   Duration dt = Time{20} - Time{5};   // 15 ns
//   double s = dt.seconds();
#pragma once

#include <compare>
#include <cstdint>

namespace fbvins {

/// A span of time in nanoseconds.
struct Duration {
  std::int64_t ns = 0;

  static constexpr Duration from_seconds(double s) { return {static_cast<std::int64_t>(s * 1e9 + (s >= 0 ? 0.5 : -0.5))}; }
  constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  constexpr auto operator<=>(const Duration&) const = default;
  constexpr Duration operator-() const { return {-ns}; }
};

/// An instant of the sensors' clock in nanoseconds.
struct Time {
  std::int64_t ns = 0;

  constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  constexpr auto operator<=>(const Time&) const = default;
};

constexpr Duration operator+(Duration a, Duration b) { return {a.ns + b.ns}; }
constexpr Duration operator-(Duration a, Duration b) { return {a.ns - b.ns}; }
constexpr Duration operator-(Time a, Time b) { return {a.ns - b.ns}; }
constexpr Time operator+(Time t, Duration d) { return {t.ns + d.ns}; }
constexpr Time operator-(Time t, Duration d) { return {t.ns - d.ns}; }

}  // namespace fbvins
