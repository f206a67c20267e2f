// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/rectified_pair.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fbvins {
namespace {

/// Negative disparities down to this are taken as points at infinity, not as wrong.
constexpr double kInfinity_px = 1.0;
/// Smallest z of a rotated (x, y, 1) that still has rectified coordinates.
constexpr double kGrazing = 0.05;

std::optional<Vec2> rectify(const Mat3& R, const Vec2& normalised) {
  const Vec3 ray = R * normalised.homogeneous();
  if (!(ray.z() > kGrazing)) return std::nullopt;
  return ray.hnormalized();
}

}  // namespace

RectifiedPair::RectifiedPair(const StereoRig& rig, double min_depth_m, double epipolar_px)
    : min_depth_m_(min_depth_m), epipolar_px_(epipolar_px), focal_px_(rig.right().focal_px()) {
  place(rig.T_C1C0());
}

void RectifiedPair::place(const Pose<C1, C0>& T_C1C0) {
  const Vec3 right_centre = -(T_C1C0.R().transpose() * T_C1C0.p);
  baseline_m_ = right_centre.norm();
  const Vec3 x = right_centre.normalized();
  const Vec3 y = Vec3::UnitZ().cross(x).normalized();
  R_rect_left_ << x.transpose(), y.transpose(), x.cross(y).transpose();
  R_rect_right_ = R_rect_left_ * T_C1C0.R().transpose();
}

std::optional<double> RectifiedPair::inverse_depth(const Vec2& left_normalised, const Vec2& right_normalised) const {
  const auto left = rectify(R_rect_left_, left_normalised), right = rectify(R_rect_right_, right_normalised);
  if (!left || !right) return std::nullopt;
  if (std::abs(left->y() - right->y()) * focal_px_ > epipolar_px_) return std::nullopt;
  const double disparity = left->x() - right->x();
  if (disparity < -kInfinity_px / focal_px_) return std::nullopt;
  // depth along the rectified z is baseline / disparity; this turns it into depth along z of C0
  const double z_of_unit_depth = (R_rect_left_.transpose() * left->homogeneous()).z();
  const double rho = std::max(disparity, 0.0) / (baseline_m_ * z_of_unit_depth);
  if (rho > 1.0 / min_depth_m_) return std::nullopt;
  return rho;
}

}  // namespace fbvins
