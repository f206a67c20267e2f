// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/klt_stereo.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/triangulation.hpp"

namespace fbvins {
namespace {

/// Level of the correlation search, and the coarsest of the alignment that follows it.
constexpr int kSearchLevel = 2;
constexpr int kMostSteps = 200;
/// Correlation that the search must reach.
constexpr double kMinSearchCorrelation = 0.6;
/// Largest distance from the epipolar line in the right image.
constexpr double kEpipolar_px = 1.5;
/// A match may be nearer than the smallest depth searched for by this factor: noise of the disparity.
constexpr double kNearerThanSearched = 1.2;
/// Negative disparities down to this are taken as points at infinity, not as wrong.
constexpr double kInfinity_px = 1.0;
/// Patches of images that are turned against each other by less, rad, are matched as they are.
constexpr double kLeastTurned_rad = 0.5;
/// Of each side of the image.
constexpr int kSamples = 16;

/// The patch around a feature as the right camera sees it, which is turned by R_rl and where its depth is `depth_ratio` times
/// that in the left one.
PatchReference seen_from_right(PatchReference patch, const Mat3& R_rl, double depth_ratio) {
  patch.carry(R_rl, depth_ratio);
  return patch;
}

/// Whether a far thing that both cameras see stands turned in one image against the other, somewhere.
bool images_are_turned(const StereoRig& rig) {
  if (!rig.has_right()) return false;
  const Mat3 R_rl = rig.T_C1C0().R();
  for (int y = 0; y < kSamples; ++y)
    for (int x = 0; x < kSamples; ++x) {
      const Vec2 left_px((x + 0.5) * rig.left().width() / kSamples, (y + 0.5) * rig.left().height() / kSamples);
      const auto normalised = rig.left().undistort(left_px);
      if (!normalised || rig.left().hidden(left_px, 0)) continue;
      const Vec3 p_right = R_rl * normalised->homogeneous();
      const auto right_px = rig.right().project(p_right);
      if (!right_px || !rig.right().inside(*right_px)) continue;
      PatchReference patch;
      Mat2 J_pixel_normalised;
      rig.left().distort(*normalised, &J_pixel_normalised);
      patch.J_normalised_pixel_then = J_pixel_normalised.inverse();
      const Mat2 J = seen_from_right(patch, R_rl, p_right.z()).warp(rig.right(), p_right.hnormalized());
      if (std::abs(std::atan2(J(1, 0) - J(0, 1), J(0, 0) + J(1, 1))) > kLeastTurned_rad) return true;
    }
  return false;
}

}  // namespace

KltStereoMatcher::KltStereoMatcher(const StereoRig& rig, double min_depth_m, const KltStereoEffort& effort)
    : min_depth_m_(min_depth_m),
      effort_(effort),
      camera_left_(rig.left()),
      camera_right_(rig.right()),
      turned_(images_are_turned(rig)),
      focal_px_(rig.right().focal_px()) {
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

std::optional<Vec2> KltStereoMatcher::best_along_line(const KltTemplate& patch, const Vec2& left_normalised,
                                                      const Pyramid& right) const {
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

bool KltStereoMatcher::place_in_right(const Vec2& px, const Vec2& left_normalised, StereoMatch& match) const {
  if (!visible_in_right(camera_right_, px)) return false;
  match.px = px;
  const auto normalised = camera_right_.undistort(px);
  if (!normalised) return false;
  match.normalised = *normalised;
  match.failure = check_geometry(left_normalised, match);
  return match.failure == StereoFailure::none;
}

StereoMatch KltStereoMatcher::refine(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                                     const Vec2& start_px, int coarsest, const Pyramid& left, const Pyramid& right) {
  StereoMatch match;
  const KltResult found = klt_align(patch, right, start_px, coarsest, 0);
  if (!found.ok() || !place_in_right(found.px, left_normalised, match)) return match;
  if (found.correlation > effort_.sure_correlation) return match;
  scratch_.cut(right, found.px, 0, 0);
  const KltResult back = klt_align(scratch_, left, left_px, 0, 0, kConvergedCheck_px);
  if (!back.ok() || (back.px - left_px).norm() > kForwardBackward_px) match.failure = StereoFailure::check;
  return match;
}

StereoMatch KltStereoMatcher::match(const KltTemplate& patch, const Vec2& left_px, const Vec2& left_normalised,
                                    std::optional<double> inverse_depth, const Pyramid& left, const Pyramid& right, bool search) {
  if (turned_) return match_turned(left_px, left_normalised, inverse_depth, left, right, search);
  StereoMatch match;
  if (inverse_depth) {
    if (const auto start = project(left_normalised, *inverse_depth))
      match = refine(patch, left_px, left_normalised, *start, effort_.known_depth_level, left, right);
    if (match.failure == StereoFailure::none) return match;
  }
  if (!search) return match;
  whole_.cut(left, left_px, 0, kSearchLevel);
  if (const auto start = best_along_line(whole_, left_normalised, right))
    match = refine(whole_, left_px, left_normalised, *start, kSearchLevel, left, right);
  return match;
}

StereoMatch KltStereoMatcher::match_turned(const Vec2& left_px, const Vec2& left_normalised, std::optional<double> inverse_depth,
                                           const Pyramid& left, const Pyramid& right, bool search) {
  StereoMatch match;
  PatchReference patch;
  if (!patch.take(left, left_px, camera_left_, left_normalised)) return match;
  if (inverse_depth) match = refine_turned(patch, left_px, left_normalised, *inverse_depth, left, right);
  if (match.failure == StereoFailure::none || !search) return match;
  if (const auto found = search_turned(patch, left_normalised, right))
    match = refine_turned(patch, left_px, left_normalised, *found, left, right);
  return match;
}

/// The inverse depth of the best correlation.
std::optional<double> KltStereoMatcher::search_turned(const PatchReference& patch, const Vec2& left_normalised,
                                                      const Pyramid& right) {
  const Vec3 far_ray = R_rl_ * left_normalised.homogeneous();
  const auto far = project(left_normalised, 0), near = project(left_normalised, 1 / min_depth_m_);
  if (!far || !near) return std::nullopt;
  const PatchReference seen = seen_from_right(patch, R_rl_, far_ray.z());
  if (!scratch_.cut_warped(seen.patch, seen.warp(camera_right_, far_ray.hnormalized()).inverse())) return std::nullopt;
  const int steps = std::clamp(static_cast<int>((*near - *far).norm()) + 1, 1, kMostSteps);
  float best = static_cast<float>(kMinSearchCorrelation);
  std::optional<double> best_inverse_depth;
  for (int i = 0; i <= steps; ++i) {
    const double rho = i / (steps * min_depth_m_);
    const auto px = project(left_normalised, rho);
    if (!px || !visible_in_right(camera_right_, *px)) continue;
    const float correlation = klt_correlation(scratch_.levels[0], right.level(0), *px);
    if (correlation > best) best = correlation, best_inverse_depth = rho;
  }
  return best_inverse_depth;
}

StereoMatch KltStereoMatcher::refine_turned(const PatchReference& patch, const Vec2& left_px, const Vec2& left_normalised,
                                            double inverse_depth, const Pyramid& left, const Pyramid& right) {
  StereoMatch match;
  const Vec3 p_right = R_rl_ * left_normalised.homogeneous() + inverse_depth * p_rl_;
  const auto start = camera_right_.project(p_right);
  if (!start || !visible_in_right(camera_right_, *start)) return match;
  const PatchReference seen = seen_from_right(patch, R_rl_, p_right.z());
  const KltResult found = refiner_.refine(seen, right, *start, camera_right_, p_right.hnormalized());
  if (!found.ok() || !place_in_right(found.px, left_normalised, match)) return match;
  PatchReference back_patch;
  const bool cut = back_patch.take(right, found.px, camera_right_, match.normalised);
  if (cut) back_patch.carry(R_rl_.transpose(), 1 / p_right.z());
  const KltResult back = cut ? refiner_.refine(back_patch, left, left_px, camera_left_, left_normalised) : KltResult{};
  if (!back.ok() || (back.px - left_px).norm() > kForwardBackward_px) match.failure = StereoFailure::check;
  return match;
}

}  // namespace fbvins
