// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/patch_refine.hpp"

#include <Eigen/LU>

namespace fbvins {
namespace {

/// Farthest that a keypoint may be moved, times the scale of its level.
constexpr double kMaxShift_px = 3.0;
/// A reference seen smaller than this, or larger than its inverse, is given up.
constexpr double kSmallestScale = 0.65;

}  // namespace

bool PatchReference::take(const Pyramid& pyramid, const Vec2& px, const Camera& camera, const Vec2& normalised) {
  Mat2 J_pixel_normalised;
  camera.distort(normalised, &J_pixel_normalised);
  J_normalised_pixel_then = J_pixel_normalised.inverse();
  R_now_then.setIdentity();
  depth_ratio = 1;
  return patch.take(pyramid, px);
}

void PatchReference::carry(const Mat3& R_now_before, double depth_factor) {
  R_now_then = R_now_before * R_now_then;
  depth_ratio *= depth_factor;
}

Mat2 PatchReference::warp(const Camera& camera, const Vec2& normalised_now) const {
  Mat2 J_pixel_normalised;
  camera.distort(normalised_now, &J_pixel_normalised);
  // Steps on the plane z = const then, turned, projected: (x, y, z)/z with z = depth_ratio.
  Eigen::Matrix<double, 2, 3> J_normalised_point;
  J_normalised_point << 1, 0, -normalised_now.x(), 0, 1, -normalised_now.y();
  return J_pixel_normalised * J_normalised_point * R_now_then.leftCols<2>() / depth_ratio * J_normalised_pixel_then;
}

KltResult PatchRefiner::refine(const PatchReference& reference, const Pyramid& image, const Vec2& start_px, const Camera& camera,
                               const Vec2& normalised_guess) {
  const Mat2 J_now_then = reference.warp(camera, normalised_guess);
  const double area = J_now_then.determinant(), limit = kSmallestScale * kSmallestScale;
  if (!(area > limit && area * limit < 1)) return {};
  if (!warped_.cut_warped(reference.patch, J_now_then.inverse())) return {};
  return klt_align(warped_, image, start_px, 0, 0);
}

bool PatchRefiner::accept(const KltResult& result, const Vec2& start_px, double scale, double min_correlation) {
  return result.ok() && result.correlation >= min_correlation && (result.px - start_px).norm() <= kMaxShift_px * scale;
}

}  // namespace fbvins
