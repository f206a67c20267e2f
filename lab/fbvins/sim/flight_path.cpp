// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/flight_path.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

constexpr double kStep_m = 0.04;  ///< of the points along the path

std::vector<Vec3> points_along(const std::vector<Vec3>& corners) {
  std::vector<Vec3> points{corners.front()};
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Vec3 d = corners[i + 1] - corners[i];
    const int n = std::max(1, static_cast<int>(std::lround(d.norm() / kStep_m)));
    for (int k = 1; k <= n; ++k) points.push_back(corners[i] + d * k / n);
  }
  return points;
}

/// Speed at each point: curvature first, then braking and accelerating along the path.
std::vector<double> speeds_along(const std::vector<Vec3>& p, const MotionLimits& limits) {
  const std::size_t n = p.size();
  std::vector<double> v(n, limits.speed_mps);
  const int reach = 3;
  for (std::size_t i = reach; i + reach < n; ++i) {
    const Vec3 a = p[i] - p[i - reach], b = p[i + reach] - p[i];
    const double length = 0.5 * (a.norm() + b.norm());
    if (length < 1e-6) continue;
    const double curvature = (b.normalized() - a.normalized()).norm() / length;
    v[i] = std::min(v[i], std::sqrt(0.6 * limits.accel_mps2 / std::max(curvature, 1e-6)));
  }
  const double along = 0.5 * limits.accel_mps2;
  v.front() = v.back() = 0.02;
  for (std::size_t i = 1; i < n; ++i)
    v[i] = std::min(v[i], std::sqrt(v[i - 1] * v[i - 1] + 2 * along * (p[i] - p[i - 1]).norm()));
  for (std::size_t i = n - 1; i-- > 0;)
    v[i] = std::min(v[i], std::sqrt(v[i + 1] * v[i + 1] + 2 * along * (p[i + 1] - p[i]).norm()));
  return v;
}

std::vector<Vec3> sample_in_time(const std::vector<Vec3>& p, const std::vector<double>& v, double dt) {
  std::vector<Vec3> samples;
  double t = 0, next = 0;
  for (std::size_t i = 0; i + 1 < p.size(); ++i) {
    const double mean = 0.5 * (v[i] + v[i + 1]);
    const double span = std::max(1e-9, (p[i + 1] - p[i]).norm() / std::max(mean, 0.02));
    for (; next <= t + span; next += dt) samples.push_back(p[i] + (p[i + 1] - p[i]) * ((next - t) / span));
    t += span;
  }
  samples.push_back(p.back());
  return samples;
}

double largest_difference(std::vector<Vec3> c, int order) {
  for (int k = 0; k < order; ++k) {
    for (std::size_t i = 0; i + 1 < c.size(); ++i) c[i] = c[i + 1] - c[i];
    if (!c.empty()) c.pop_back();
  }
  double largest = 0;
  for (const Vec3& d : c) largest = std::max(largest, d.norm());
  return largest;
}

}  // namespace

double slowdown_needed(const TimedPath& path, const MotionLimits& limits) {
  const double dt = path.knot_spacing_s;
  return std::max({largest_difference(path.positions, 1) / dt / limits.speed_mps,
                   std::sqrt(largest_difference(path.positions, 2) / (dt * dt) / limits.accel_mps2),
                   std::cbrt(largest_difference(path.positions, 3) / (dt * dt * dt) / limits.jerk_mps3)});
}

TimedPath fly_along(const std::vector<Vec3>& corners, const MotionLimits& limits, double corner_radius_m) {
  std::vector<Vec3> points = points_along(corners);
  const Vec3 zero = Vec3::Zero();
  smooth(points, static_cast<int>(corner_radius_m / kStep_m), 3, zero);
  TimedPath path;
  path.positions = sample_in_time(points, speeds_along(points, limits), path.knot_spacing_s);
  // Acceleration changes over about accel / jerk seconds.
  const double ramp_s = std::max(0.15, limits.accel_mps2 / limits.jerk_mps3);
  const int half = std::max(2, static_cast<int>(0.5 * ramp_s / path.knot_spacing_s));
  const std::size_t hold = static_cast<std::size_t>(3 * half);  // so that both ends stay at rest
  path.positions.insert(path.positions.begin(), hold, Vec3(path.positions.front()));
  path.positions.insert(path.positions.end(), hold, Vec3(path.positions.back()));
  smooth(path.positions, half, 3, zero);
  path.knot_spacing_s *= std::max(1.0, slowdown_needed(path, limits));
  return path;
}

}  // namespace fbvins
