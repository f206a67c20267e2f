// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_stereo.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/triangulation.hpp"

namespace fbvins {
namespace {

constexpr int kSearchLevel = 2;
/// Disparities down to this are taken as infinitely far rather than as wrong.
constexpr double kInfinity_px = 1.0;

}  // namespace

KltStereoMatcher::KltStereoMatcher(const StereoRig& rig, const KltStereoOptions& options, const KltOptions& klt)
    : options_(options),
      klt_(klt),
      camera_right_(rig.right),
      R_rl_(rig.T_C1C0().R()),
      p_rl_(rig.T_C1C0().p),
      focal_px_(rig.right.focal_px()) {}

std::optional<Vec2> KltStereoMatcher::project(const Vec2& left_normalised, double inverse_depth) const {
  const Vec3 ray = R_rl_ * left_normalised.homogeneous() + inverse_depth * p_rl_;
  return camera_right_.project(ray);
}

std::optional<Vec2> KltStereoMatcher::search(const KltTemplate& patch, const Vec2& left_normalised, const Pyramid& right) const {
  const int l = std::min(kSearchLevel, right.levels() - 1);
  const KltLevelTemplate& level_patch = patch.levels[static_cast<std::size_t>(l)];
  const auto far = project(left_normalised, 0), near = project(left_normalised, 1 / options_.min_depth_m);
  if (!level_patch.valid || !far || !near) return std::nullopt;
  const double scale = 1 << l;
  // Steps of about a pixel of the level: the patch is 16 wide, so a peak is a few steps wide.
  const int steps = std::clamp(static_cast<int>((*near - *far).norm() / scale) + 1, 1, 200);
  float best = static_cast<float>(options_.min_search_correlation);
  std::optional<Vec2> best_px;
  for (int i = 0; i <= steps; ++i) {
    const auto px = project(left_normalised, i / (steps * options_.min_depth_m));
    if (!px) continue;
    const float correlation = klt_correlation(level_patch, right.level(l), *px / scale);
    if (correlation > best) {
      best = correlation;
      best_px = px;
    }
  }
  return best_px;
}

StereoFailure KltStereoMatcher::check_geometry(const Vec2& left_normalised, StereoMatch& match) const {
  const Vec3 far = R_rl_ * left_normalised.homogeneous();
  const Vec3 seen = match.normalised.homogeneous();
  const auto off_line = distance_from_epipolar_line(far, p_rl_, seen);
  if (off_line && *off_line * focal_px_ > options_.epipolar_px) return StereoFailure::epipolar;
  const auto rho = inverse_depth_along(far, p_rl_, seen);
  const double rho_per_px = 1 / (focal_px_ * p_rl_.norm());
  if (!rho || *rho < -kInfinity_px * rho_per_px || *rho > 1.2 / options_.min_depth_m) return StereoFailure::epipolar;
  match.inverse_depth = std::max(*rho, 0.0);
  return StereoFailure::none;
}

StereoMatch KltStereoMatcher::refine(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                                     const Vec2& start_px, int coarsest, const Pyramid& left, const Pyramid& right) {
  StereoMatch match;
  const KltResult found = klt_align(patch, right, start_px, coarsest, 0, klt_);
  if (!found.ok() || !camera_right_.inside(found.px, 2)) return match;
  match.px = found.px;
  const auto normalised = camera_right_.undistort(found.px);
  if (!normalised) return match;
  match.normalised = *normalised;
  match.failure = check_geometry(left_normalised, match);
  if (match.failure != StereoFailure::none) return match;
  scratch_.cut(right, found.px, 0, 0);
  const KltResult back = klt_align(scratch_, left, left_px, 0, 0, klt_);
  if (!back.ok() || (back.px - left_px).norm() > options_.forward_backward_px) match.failure = StereoFailure::check;
  return match;
}

StereoMatch KltStereoMatcher::match(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                                    std::optional<double> inverse_depth, const Pyramid& left, const Pyramid& right) {
  StereoMatch match;
  if (inverse_depth) {
    if (const auto start = project(left_normalised, *inverse_depth))
      match = refine(patch, left_px, left_normalised, *start, 1, left, right);
    if (match.failure == StereoFailure::none) return match;
  }
  if (const auto start = search(patch, left_normalised, right))
    match = refine(patch, left_px, left_normalised, *start, 2, left, right);
  return match;
}

}  // namespace fbvins
