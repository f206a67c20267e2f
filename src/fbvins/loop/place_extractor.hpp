// SPDX-License-Identifier: Apache-2.0
// Keyframe images -> Place: ORB features of the left image, each searched along its epipolar curve in the right one
// and refined by Lucas-Kanade (cheaper and finer than matching the features of two images). Buffers are reused; one
// instance, one thread.
//
//   PlaceExtractor extractor(rig, {}, vocabulary);
//   Place place = extractor.extract(keyframe);
#pragma once

#include <memory>
#include <optional>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/features/descriptor_stage.hpp"
#include "fbvins/features/klt.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/place.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

class PlaceExtractor {
 public:
  /// `stage` may replace the descriptors (boosted ones need their own vocabulary).
  PlaceExtractor(const StereoRig& rig, const PlaceExtractorOptions& options, Vocabulary vocabulary,
                 std::unique_ptr<DescriptorStage> stage = make_identity_stage());

  /// Empty when the left image is missing; without depth when the right one and the depth image are. Images that the two cameras
  /// took at different times are matched with the baseline that they had then (S3, S4); without readings there is no depth.
  Place extract(const Keyframe& keyframe);
  /// Images of one instant. `R_LB`: gravity-aligned attitude of the body.
  Place extract(const StereoFrame& images, const Mat3& R_LB) { return extract(images, R_LB, rig_.T_C1C0()); }

 private:
  Place extract(const StereoFrame& images, const Mat3& R_LB, const std::optional<Pose<C1, C0>>& T_C1C0);
  std::optional<MeasuredInverseDepth> stereo(const Vec2& left_px, const Vec2& left_normalised);
  std::optional<Vec2> search(const Vec2& left_normalised) const;
  std::optional<Vec2> project(const Vec2& left_normalised, double inverse_depth) const;

  StereoRig rig_;
  std::optional<DepthReader> depth_;
  Vocabulary vocabulary_;
  std::unique_ptr<DescriptorStage> stage_;
  Mat3 R_rl_;  // of the images at hand
  Vec3 p_rl_;
  double focal_px_;
  OrbExtractor orb_;
  OrbFeatures found_;
  Pyramid left_, right_;
  KltTemplate patch_;
};

}  // namespace fbvins
