// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_stereo.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "fbvins/frontend/orb_matching.hpp"

namespace fbvins {
namespace {

/// Negative disparities down to this are taken as points at infinity, not as wrong.
constexpr double kInfinity_px = 1.0;
/// Half-width of the band that is searched, times the scale of the keypoint, up to the largest scale.
constexpr double kBand_px = 2.0;
constexpr float kLargestScale = 3.0f;
constexpr int kLevelsApart = 1;
constexpr int kMaxStereoDistance_bits = 64;
/// Smallest z of a rotated (x, y, 1) that still has rectified coordinates.
constexpr double kGrazing = 0.05;

}  // namespace

OrbStereoMatcher::OrbStereoMatcher(const StereoRig& rig, double min_depth_m, double epipolar_px)
    : min_depth_m_(min_depth_m), epipolar_px_(epipolar_px), right_camera_(rig.right), focal_px_(rig.right.focal_px()) {
  place(rig.T_C1C0());
}

void OrbStereoMatcher::place(const Pose<C1, C0>& T_C1C0) {
  const Vec3 right_centre = -(T_C1C0.R().transpose() * T_C1C0.p);
  baseline_m_ = right_centre.norm();
  const Vec3 x = right_centre.normalized();
  const Vec3 y = Vec3::UnitZ().cross(x).normalized();
  R_rect_left_ << x.transpose(), y.transpose(), x.cross(y).transpose();
  R_rect_right_ = R_rect_left_ * T_C1C0.R().transpose();
}

std::optional<Vec2> OrbStereoMatcher::rectify(const Mat3& R, const Vec2& normalised) const {
  const Vec3 ray = R * normalised.homogeneous();
  if (!(ray.z() > kGrazing)) return std::nullopt;
  return ray.hnormalized();
}

void OrbStereoMatcher::index(const OrbFeatures& right) {
  right_ = &right;
  entries_.clear();
  for (std::size_t i = 0; i < right.size(); ++i) {
    const auto normalised = right_camera_.undistort(right.keypoints[i].pixel);
    if (!normalised) continue;
    if (const auto at = rectify(R_rect_right_, *normalised)) entries_.push_back({*at, static_cast<std::int32_t>(i)});
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.rectified.y() != b.rectified.y() ? a.rectified.y() < b.rectified.y() : a.keypoint < b.keypoint;
  });
}

int OrbStereoMatcher::candidate(const Vec2& left_normalised, int level, const Descriptor& descriptor) {
  const auto left = rectify(R_rect_left_, left_normalised);
  if (!left || right_ == nullptr) return -1;
  const double band = kBand_px / focal_px_, infinity = kInfinity_px / focal_px_;
  const double nearest = baseline_m_ / min_depth_m_;
  near_.clear();
  auto it = std::lower_bound(entries_.begin(), entries_.end(), left->y() - kLargestScale * band,
                             [](const Entry& e, double y) { return e.rectified.y() < y; });
  for (; it != entries_.end() && it->rectified.y() <= left->y() + kLargestScale * band; ++it) {
    const Keypoint& keypoint = right_->keypoints[static_cast<std::size_t>(it->keypoint)];
    const double scale = std::min(keypoint.scale, kLargestScale);
    const double disparity = left->x() - it->rectified.x();
    if (std::abs(it->rectified.y() - left->y()) > scale * band || std::abs(keypoint.level - level) > kLevelsApart) continue;
    if (disparity >= -scale * infinity && disparity <= nearest) near_.push_back(it->keypoint);
  }
  distance_.resize(near_.size());
  hamming_distances(descriptor, right_->descriptors, near_, distance_.data());
  int distance = 0;
  return pick_match(near_, distance_, right_->keypoints, kMaxStereoDistance_bits, &distance);
}

std::optional<double> OrbStereoMatcher::inverse_depth(const Vec2& left_normalised, const Vec2& right_normalised) const {
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
