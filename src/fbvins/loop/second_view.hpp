// SPDX-License-Identifier: Apache-2.0
// Depths of features of the left image from a second view of what it shows: the right camera's, or the left camera's own of some
// moments before. Each feature is searched along its epipolar curve and refined by Lucas-Kanade, which is cheaper and finer than
// to match the features of two images. Buffers are reused; one instance, one thread.
//
//   SecondViewDepths depths(rig.left().focal_px());
//   depths.set(frame.left()->view(), frame.right()->view(), {&rig.right(), T_C1C0.R(), T_C1C0.p});
//   if (auto depth = depths.at(px, *rig.left().undistort(px))) use(depth->value, depth->sigma);
#pragma once

#include <optional>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/features/klt.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// How a second camera stood to the left one, whose frame is C0: p_second = R p_C0 + p.
struct SecondView {
  const Camera* lens = nullptr;  ///< outlives the view
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();
  double nearest_m = 0.4;             ///< nearer points are not searched for
  double sigma_rad = 0, sigma_m = 0;  ///< standard deviations, per axis, of R and p
};

/// Standard deviation of an inverse depth rho (in C0) that is measured in a second view (L30): `far` = R (x, y, 1).
double inverse_depth_sigma(const SecondView& view, double focal_px, const Vec3& far, double rho);

class SecondViewDepths {
 public:
  /// `focal_px`: of the left camera.
  explicit SecondViewDepths(double focal_px) : focal_px_(focal_px) {}

  void set(const ImageView& left, const ImageView& second, const SecondView& view);
  /// All points that it shows are farther away by this factor.
  void stretch(double factor) { view_.p *= factor, view_.sigma_m *= factor; }
  /// Along z of C0, 1/m, of the feature at this pixel of the left image, x/z and y/z of whose ray are given. None where nothing
  /// alike is seen near the epipolar curve.
  std::optional<MeasuredInverseDepth> at(const Vec2& left_px, const Vec2& left_normalised);

 private:
  std::optional<Vec2> search(const Vec2& left_normalised) const;
  std::optional<Vec2> project(const Vec2& left_normalised, double inverse_depth) const;
  std::optional<Vec2> find(const Vec2& left_px, const Vec2& left_normalised);

  double focal_px_;
  SecondView view_;
  Pyramid left_, second_;
  KltTemplate patch_;
};

}  // namespace fbvins
