// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/second_view.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/triangulation.hpp"

namespace fbvins {
namespace {

constexpr int kSearchLevel = 2;  // of the image pyramid, for the search along the epipolar curve
constexpr int kAlignLevel = 1;   // coarsest of the alignment that follows it
constexpr double kMinSearchCorrelation = 0.7;
/// The curve is nearly straight on the search level: it is projected at the ends of so many pieces.
constexpr int kPieces = 6;
/// Of the search level: the patch is 16 wide, so a peak is a few steps wide.
constexpr double kStep_px = 2.0;
constexpr int kMaxStepsOfAPiece = 64;
/// Largest distance from the epipolar curve after refinement.
constexpr double kEpipolar_px = 1.0;
/// Where a narrow patch moves farther than this, a wide one shows two things.
constexpr double kOtherThing_px = 1.0;
/// Refinement may leave the depths that were searched by this factor.
constexpr double kNearerThanSearched = 1.1;
/// Standard deviation of a disparity.
constexpr double kDisparity_px = 0.25;
/// Negative disparities down to this are taken for points at infinity, not for wrong matches.
constexpr double kInfinity_px = 1.0;

double square(double x) { return x * x; }

/// Inverse depth per pixel of the second image, d(rho)/d(seen): by the part of the baseline that is across the ray.
double rho_per_px(const SecondView& view, double focal_px, const Vec3& far, double rho, const Vec2& seen) {
  const double across_m = (view.p.head<2>() - view.p.z() * seen).norm() / (far.z() + rho * view.p.z());
  return 1 / (focal_px * across_m);
}

/// A disparity's standard deviation, with what the pose's error displaces a point of this inverse depth by.
double disparity_sigma_px(const SecondView& view, double focal_px, double rho) {
  return std::sqrt(square(kDisparity_px) + square(focal_px * view.sigma_rad) + square(focal_px * rho * view.sigma_m));
}

}  // namespace

double inverse_depth_sigma(const SecondView& view, double focal_px, const Vec3& far, double rho) {
  const Vec2 seen = (far + rho * view.p).hnormalized();
  return disparity_sigma_px(view, focal_px, rho) * rho_per_px(view, focal_px, far, rho, seen);
}

void SecondViewDepths::set(const ImageView& left, const ImageView& second, const SecondView& view) {
  view_ = view;
  left_.build(left, kSearchLevel + 1);
  second_.build(second, kSearchLevel + 1);
}

std::optional<Vec2> SecondViewDepths::project(const Vec2& left_normalised, double inverse_depth) const {
  return view_.lens->project(view_.R * left_normalised.homogeneous() + inverse_depth * view_.p);
}

/// Position of the best correlation along the epipolar curve, on a coarse level.
std::optional<Vec2> SecondViewDepths::search(const Vec2& left_normalised) const {
  const int l = std::min(kSearchLevel, second_.levels() - 1);
  const KltLevelTemplate& patch = patch_.levels[static_cast<std::size_t>(l)];
  if (!patch.valid) return std::nullopt;
  const double scale = 1 << l;
  float best = static_cast<float>(kMinSearchCorrelation);
  std::optional<Vec2> best_px, from = project(left_normalised, 0);
  for (int piece = 1; piece <= kPieces; ++piece) {
    const auto to = project(left_normalised, piece / (kPieces * view_.nearest_m));
    if (from && to) {
      const int steps = std::clamp(static_cast<int>((*to - *from).norm() / (kStep_px * scale)) + 1, 1, kMaxStepsOfAPiece);
      for (int i = 0; i < steps; ++i) {
        const Vec2 px = *from + (*to - *from) * (static_cast<double>(i) / steps);
        const float correlation = klt_correlation_about(patch, second_.level(l), px / scale);
        if (correlation > best) best = correlation, best_px = px;
      }
    }
    from = to;
  }
  return best_px;
}

/// Where the second image shows what the left one has at this pixel.
std::optional<Vec2> SecondViewDepths::find(const Vec2& left_px, const Vec2& left_normalised) {
  const int search_level = std::min(kSearchLevel, left_.levels() - 1);
  if (!patch_.cut(left_, left_px, search_level, search_level)) return std::nullopt;
  const auto start = search(left_normalised);
  if (!start || !patch_.cut(left_, left_px, 0, kAlignLevel)) return std::nullopt;
  const KltResult near = klt_align(patch_, second_, *start, kAlignLevel, 0);
  if (!near.ok() || !patch_.cut(left_, left_px, 0, 0, KltWindow::narrow)) return std::nullopt;
  const KltResult found = klt_align(patch_, second_, near.px, 0, 0);
  if (!found.ok() || (found.px - near.px).norm() > kOtherThing_px) return std::nullopt;
  if (!view_.lens->inside(found.px, 2) || view_.lens->hidden(found.px, kPatchBorder_px)) return std::nullopt;
  return found.px;
}

std::optional<MeasuredInverseDepth> SecondViewDepths::at(const Vec2& left_px, const Vec2& left_normalised) {
  const auto found_px = find(left_px, left_normalised);
  if (!found_px) return std::nullopt;
  const auto xy = view_.lens->undistort(*found_px);
  if (!xy) return std::nullopt;
  const Vec3 far = view_.R * left_normalised.homogeneous(), seen = xy->homogeneous();
  const auto off_line = distance_from_epipolar_line(far, view_.p, seen);
  if (!off_line || *off_line * focal_px_ > kEpipolar_px) return std::nullopt;
  const auto rho = inverse_depth_along(far, view_.p, seen);
  if (!rho || far.z() + *rho * view_.p.z() <= 0) return std::nullopt;
  const double per_px = rho_per_px(view_, focal_px_, far, *rho, seen.head<2>());
  if (*rho < -kInfinity_px * per_px || *rho > kNearerThanSearched / view_.nearest_m) return std::nullopt;
  return MeasuredInverseDepth{std::max(*rho, 0.0), disparity_sigma_px(view_, focal_px_, *rho) * per_px};
}

}  // namespace fbvins
