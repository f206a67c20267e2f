// SPDX-License-Identifier: Apache-2.0
// Which matches of two images agree with one rigid motion (paper 2.2.3, eq. 12-14, with the essential
// matrix as the geometric relation). Pure function, safe on any thread; the Rng makes it repeatable.
//
//   EpipolarOptions options;
//   options.threshold = 1.0 / camera.focal_px();                       // one pixel
//   Rng rng(7);
//   auto result = ransac_epipolar(previous, current, R_gyro, options, rng);
//   if (!result.inlier[i]) drop(i);
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct EpipolarOptions {
  /// Largest Sampson distance of an inlier in normalised coordinates: pixels / focal length.
  double threshold = 1.0 / 460.0;
  int max_iterations = 200;  ///< samples tried at most
};

struct EpipolarResult {
  std::vector<std::uint8_t> inlier;  ///< one flag a match
  int inliers = 0;
  Mat3 E = Mat3::Zero();  ///< b^T E a = 0; E = [t_ba]x R_ba
  Mat3 R_ba = Mat3::Identity();
  /// Direction, sign not decided; zero when too few matches; arbitrary where a rotation alone explains them (rotation on the
  /// spot, standstill), and the constraint only sees errors across the epipolar lines that it gives then.
  Vec3 t_ba = Vec3::Zero();
  int iterations = 0;
};

/// a, b: matches in normalised coordinates of the two images. R_ba, if known (gyro): rotation that
/// takes rays of a to rays of b; then samples need two matches only, and an error of R_ba of a few
/// thresholds is taken out by refining rotation and translation together on the inliers.
/// Without R_ba: five-point samples, with rotation-only models beside them so that a missing
/// translation is no special case. Fewer than 3 (with R_ba) or 6 matches: all are called inliers.
EpipolarResult ransac_epipolar(std::span<const Vec2> a, std::span<const Vec2> b, const std::optional<Mat3>& R_ba,
                               const EpipolarOptions& options, Rng& rng);

/// Signed first-order (Sampson) distance of a match to the epipolar constraint, normalised units.
double sampson_distance(const Mat3& E, const Vec2& a, const Vec2& b);

}  // namespace fbvins
