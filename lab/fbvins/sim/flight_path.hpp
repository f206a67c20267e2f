// SPDX-License-Identifier: Apache-2.0
// From corners in space to positions over time: rounds a polyline, chooses the speed along it within
// limits, and makes sure that the B-spline with the result as control points keeps them. Pure functions.
#pragma once

#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct MotionLimits {
  double speed_mps, accel_mps2, jerk_mps3;
};

/// Control points of a uniform B-spline.
struct TimedPath {
  double knot_spacing_s = 0.05;
  std::vector<Vec3> positions;
};

/// Starts and ends at rest at the first and last corner.
TimedPath fly_along(const std::vector<Vec3>& corners, const MotionLimits& limits, double corner_radius_m);

/// Moving average over 2 * half_width + 1 values, the ends extended, applied `passes` times.
template <class T>
void smooth(std::vector<T>& values, int half_width, int passes, const T& zero) {
  const int n = static_cast<int>(values.size());
  std::vector<T> sums(values.size() + 1, zero);
  for (int pass = 0; pass < passes && half_width > 0; ++pass) {
    const std::vector<T> old = values;
    const auto held = [&](int i) -> const T& { return old[static_cast<std::size_t>(i < 0 ? 0 : i >= n ? n - 1 : i)]; };
    T sum = zero;
    for (int i = -half_width; i <= half_width; ++i) sum = sum + held(i);
    for (int i = 0; i < n; ++i) {
      values[static_cast<std::size_t>(i)] = sum / (2.0 * half_width + 1);
      sum = sum + held(i + half_width + 1) - held(i - half_width);
    }
  }
}

/// Factor by which time must be stretched to keep the limits; at most 1: they are kept.
/// A B-spline's derivatives are bounded by the differences of its control points (convex hull).
double slowdown_needed(const TimedPath& path, const MotionLimits& limits);

}  // namespace fbvins
