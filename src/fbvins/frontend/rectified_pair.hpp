// SPDX-License-Identifier: Apache-2.0
// The depth of a match of the left and the right image. Rays of both cameras are rotated so that the baseline is the x axis;
// those that meet then differ in x only (rectified normalised coordinates; images are never rectified).
//
//   RectifiedPair pair(rig, 0.35, 1.5);
//   auto inverse_depth = pair.inverse_depth(left_normalised, right_normalised);   // 1/m, or nothing
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

class RectifiedPair {
 public:
  /// `min_depth_m`: nearest point that is matched. `epipolar_px`: largest distance from the epipolar line.
  RectifiedPair(const StereoRig& rig, double min_depth_m, double epipolar_px);

  /// Between the images that are matched next.
  void place(const Pose<C1, C0>& T_C1C0);
  /// 1/m along z of C0; nothing when the rays are too far from a common epipolar plane or meet too near or behind.
  std::optional<double> inverse_depth(const Vec2& left_normalised, const Vec2& right_normalised) const;

 private:
  double min_depth_m_, epipolar_px_;
  Mat3 R_rect_left_, R_rect_right_;
  double baseline_m_, focal_px_;
};

}  // namespace fbvins
