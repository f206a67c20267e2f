// SPDX-License-Identifier: Apache-2.0
// Camera poses through three points (J. A. Grunert, 1841; in the form of R. Haralick et al., "Review and analysis of
// solutions of the three point perspective pose estimation problem", IJCV 1994). Pure function.
//
//   for (const auto& [R, t] : solve_p3p(rays, points)) score(R, t);   // ray ~ R * point + t
#pragma once

#include <array>
#include <utility>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct P3pSolutions {
  std::array<std::pair<Mat3, Vec3>, 4> pose;
  int count = 0;
  auto begin() const { return pose.begin(); }
  auto end() const { return pose.begin() + count; }
};

/// rays: directions in the camera (any length, z > 0). None where the points lie on a line.
P3pSolutions solve_p3p(const std::array<Vec3, 3>& rays, const std::array<Vec3, 3>& points);

}  // namespace fbvins
