// SPDX-License-Identifier: Apache-2.0
// A ray of one camera as seen from a second one. The ray's point of inverse depth rho (in the first camera) lies in direction
// far + rho * t of the second, with far = R ray and (R, t) from the first camera to the second. Pure functions, any thread.
//
//   if (auto d = distance_from_epipolar_line(far, t, seen); d && *d < limit)
//     if (auto rho = inverse_depth_along(far, t, seen)) use(*rho);
#pragma once

#include <optional>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Distance of `seen` = (x, y, 1) from the epipolar line of the ray in the second image, in normalised units. None where the
/// ray runs along the baseline and the line degenerates to a point.
std::optional<double> distance_from_epipolar_line(const Vec3& far, const Vec3& t, const Vec3& seen);

/// The rho for which far + rho * t points where `seen` does: least squares over the three rows of seen x (far + rho t) = 0.
/// Negative beyond infinity; none where `seen` runs along the baseline.
std::optional<double> inverse_depth_along(const Vec3& far, const Vec3& t, const Vec3& seen);

}  // namespace fbvins
