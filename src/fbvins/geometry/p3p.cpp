// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/p3p.hpp"

#include <cmath>

#include "fbvins/geometry/real_roots.hpp"

namespace fbvins {
namespace {

/// An orthonormal frame spanned by three points: x from a to b, z normal to their plane.
Mat3 frame_on(const Vec3& a, const Vec3& b, const Vec3& c) {
  Mat3 F;
  F.col(0) = (b - a).normalized();
  F.col(2) = (b - a).cross(c - a).normalized();
  F.col(1) = F.col(2).cross(F.col(0));
  return F;
}

}  // namespace

P3pSolutions solve_p3p(const std::array<Vec3, 3>& rays, const std::array<Vec3, 3>& points) {
  P3pSolutions out;
  const Vec3 j1 = rays[0].normalized(), j2 = rays[1].normalized(), j3 = rays[2].normalized();
  const double a2 = (points[1] - points[2]).squaredNorm(), b2 = (points[0] - points[2]).squaredNorm(),
               c2 = (points[0] - points[1]).squaredNorm();
  const double area2 = (points[1] - points[0]).cross(points[2] - points[0]).squaredNorm();
  if (!(area2 > 1e-8 * b2 * c2) || !(b2 > 0)) return out;
  const double ca = j2.dot(j3), cb = j1.dot(j3), cg = j1.dot(j2);
  const double k = (a2 - c2) / b2, s = (a2 + c2) / b2, ab = a2 / b2, cc = c2 / b2;
  const std::array<double, 5> quartic{
      (1 + k) * (1 + k) - 4 * ab * cg * cg, 4 * (-k * (1 + k) * cb + 2 * ab * cg * cg * cb - (1 - s) * ca * cg),
      2 * (k * k - 1 + 2 * k * k * cb * cb + 2 * (1 - cc) * ca * ca - 4 * s * ca * cb * cg + 2 * (1 - ab) * cg * cg),
      4 * (k * (1 - k) * cb - (1 - s) * ca * cg + 2 * cc * ca * ca * cb), (k - 1) * (k - 1) - 4 * cc * ca * ca};
  for (const double v : real_roots(quartic)) {
    const double denominator = 2 * (cg - v * ca);
    if (!(v > 0) || std::abs(denominator) < 1e-10) continue;
    const double u = ((k - 1) * v * v - 2 * k * cb * v + 1 + k) / denominator;
    const double d = 1 + u * u - 2 * u * cg;
    if (!(u > 0) || !(d > 0)) continue;
    const double s1 = std::sqrt(c2 / d);
    const Vec3 q1 = s1 * j1, q2 = u * s1 * j2, q3 = v * s1 * j3;
    const Mat3 R = frame_on(q1, q2, q3) * frame_on(points[0], points[1], points[2]).transpose();
    const Vec3 t = (q1 + q2 + q3) / 3 - R * (points[0] + points[1] + points[2]) / 3;
    if (R.allFinite() && t.allFinite()) out.pose[static_cast<std::size_t>(out.count++)] = {R, t};
  }
  return out;
}

}  // namespace fbvins
