// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/triangulation.hpp"

#include <cmath>

namespace fbvins {

std::optional<double> distance_from_epipolar_line(const Vec3& far, const Vec3& t, const Vec3& seen) {
  const Vec3 line = t.cross(far);
  const double across = line.head<2>().norm();
  if (!(across > 0)) return std::nullopt;
  return std::abs(seen.dot(line)) / across;
}

std::optional<double> inverse_depth_along(const Vec3& far, const Vec3& t, const Vec3& seen) {
  const Vec3 a = seen.cross(t), b = seen.cross(far);
  const double aa = a.squaredNorm();
  if (!(aa > 0)) return std::nullopt;
  return -a.dot(b) / aa;
}

}  // namespace fbvins
