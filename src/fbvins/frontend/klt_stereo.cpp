// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_stereo.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/triangulation.hpp"

namespace fbvins {
namespace {

/// Level of the correlation search, and the coarsest of the alignment that follows it.
constexpr int kSearchLevel = 2;
/// Coarsest level of the alignment from a depth that is known.
constexpr int kKnownDepthLevel = 1;
constexpr int kMostSteps = 200;
/// Correlation that the search must reach.
constexpr double kMinSearchCorrelation = 0.6;
/// Largest distance from the epipolar line in the right image.
constexpr double kEpipolar_px = 1.5;
/// A match may be nearer than the smallest depth searched for by this factor: noise of the disparity.
constexpr double kNearerThanSearched = 1.2;
/// Negative disparities down to this are taken as points at infinity, not as wrong.
constexpr double kInfinity_px = 1.0;

}  // namespace

KltStereoMatcher::KltStereoMatcher(const StereoRig& rig, double min_depth_m)
    : min_depth_m_(min_depth_m), camera_right_(rig.right), focal_px_(rig.right.focal_px()) {
  place(rig.T_C1C0());
}

void KltStereoMatcher::place(const Pose<C1, C0>& T_C1C0) {
  R_rl_ = T_C1C0.R();
  p_rl_ = T_C1C0.p;
}

std::optional<Vec2> KltStereoMatcher::project(const Vec2& left_normalised, double inverse_depth) const {
  const Vec3 ray = R_rl_ * left_normalised.homogeneous() + inverse_depth * p_rl_;
  return camera_right_.project(ray);
}

std::optional<Vec2> KltStereoMatcher::search(const KltTemplate& patch, const Vec2& left_normalised, const Pyramid& right) const {
  const int l = std::min(kSearchLevel, right.levels() - 1);
  const KltLevelTemplate& level_patch = patch.levels[static_cast<std::size_t>(l)];
  const auto far = project(left_normalised, 0), near = project(left_normalised, 1 / min_depth_m_);
  if (!level_patch.valid || !far || !near) return std::nullopt;
  const double scale = 1 << l;
  // Steps of about a pixel of the level: the patch is 16 wide, so a peak is a few steps wide.
  const int steps = std::clamp(static_cast<int>((*near - *far).norm() / scale) + 1, 1, kMostSteps);
  float best = static_cast<float>(kMinSearchCorrelation);
  std::optional<Vec2> best_px;
  for (int i = 0; i <= steps; ++i) {
    const auto px = project(left_normalised, i / (steps * min_depth_m_));
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
  if (off_line && *off_line * focal_px_ > kEpipolar_px) return StereoFailure::epipolar;
  const auto rho = inverse_depth_along(far, p_rl_, seen);
  const double rho_per_px = 1 / (focal_px_ * p_rl_.norm());
  if (!rho || *rho < -kInfinity_px * rho_per_px || *rho > kNearerThanSearched / min_depth_m_) return StereoFailure::epipolar;
  match.inverse_depth = std::max(*rho, 0.0);
  return StereoFailure::none;
}

StereoMatch KltStereoMatcher::refine(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                                     const Vec2& start_px, int coarsest, const Pyramid& left, const Pyramid& right) {
  StereoMatch match;
  const KltResult found = klt_align(patch, right, start_px, coarsest, 0);
  if (!found.ok() || !visible_in_right(camera_right_, found.px)) return match;
  match.px = found.px;
  const auto normalised = camera_right_.undistort(found.px);
  if (!normalised) return match;
  match.normalised = *normalised;
  match.failure = check_geometry(left_normalised, match);
  if (match.failure != StereoFailure::none) return match;
  scratch_.cut(right, found.px, 0, 0);
  const KltResult back = klt_align(scratch_, left, left_px, 0, 0, kConvergedCheck_px);
  if (!back.ok() || (back.px - left_px).norm() > kForwardBackward_px) match.failure = StereoFailure::check;
  return match;
}

StereoMatch KltStereoMatcher::match(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                                    std::optional<double> inverse_depth, const Pyramid& left, const Pyramid& right) {
  StereoMatch match;
  if (inverse_depth) {
    if (const auto start = project(left_normalised, *inverse_depth))
      match = refine(patch, left_px, left_normalised, *start, kKnownDepthLevel, left, right);
    if (match.failure == StereoFailure::none) return match;
  }
  if (const auto start = search(patch, left_normalised, right))
    match = refine(patch, left_px, left_normalised, *start, kSearchLevel, left, right);
  return match;
}

}  // namespace fbvins
