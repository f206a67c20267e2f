// SPDX-License-Identifier: Apache-2.0
// Left-right matching of descriptors along the epipolar band. Rays of both cameras are rotated so that the baseline
// is the x axis; matches then differ in x only (rectified normalised coordinates; images are never rectified).
// Buffers are reused; one instance, one thread.
//
//   OrbStereoMatcher stereo(rig, 0.35, 1.5);
//   stereo.index(right_features);
//   int keypoint = stereo.candidate(left_normalised, level, descriptor);          // -1: none
//   auto inverse_depth = stereo.inverse_depth(left_normalised, right_normalised); // 1/m, or nothing
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/keypoint.hpp"

namespace fbvins {

class OrbStereoMatcher {
 public:
  /// `min_depth_m`: nearest point that is matched. `epipolar_px`: largest distance from the epipolar line after refinement.
  OrbStereoMatcher(const StereoRig& rig, double min_depth_m, double epipolar_px);

  /// Between the images that are matched next.
  void place(const Pose<C1, C0>& T_C1C0);
  /// Keeps a reference to `right` until the next call.
  void index(const OrbFeatures& right);
  /// The right keypoint that matches, or -1.
  int candidate(const Vec2& left_normalised, int level, const Descriptor& descriptor);
  /// 1/m along z of C0; nothing when the rays are too far from a common epipolar plane or meet too near or behind.
  std::optional<double> inverse_depth(const Vec2& left_normalised, const Vec2& right_normalised) const;

 private:
  struct Entry {
    Vec2 rectified;
    std::int32_t keypoint;
  };
  std::optional<Vec2> rectify(const Mat3& R, const Vec2& normalised) const;

  double min_depth_m_, epipolar_px_;
  Camera right_camera_;
  Mat3 R_rect_left_, R_rect_right_;
  double baseline_m_, focal_px_;
  const OrbFeatures* right_ = nullptr;
  std::vector<Entry> entries_;  // by rectified y
  std::vector<std::int32_t> near_;
  std::vector<std::uint16_t> distance_;
};

}  // namespace fbvins
