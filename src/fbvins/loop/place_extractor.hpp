// SPDX-License-Identifier: Apache-2.0
// Keyframe images -> Place: ORB features of the left image with depths from the right one, from a depth image, or, where there is
// neither, from the left image of an earlier keyframe (second_view.hpp, earlier_views.hpp). Buffers are reused; one instance, one
// thread, one flight.
//
//   PlaceExtractor extractor(rig, {}, vocabulary);
//   Place place = extractor.extract(keyframe);
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/features/descriptor_stage.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/loop/earlier_views.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/place.hpp"
#include "fbvins/loop/second_view.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

class PlaceExtractor {
 public:
  /// `stage` may replace the descriptors (boosted ones need their own vocabulary).
  PlaceExtractor(const StereoRig& rig, const PlaceExtractorOptions& options, Vocabulary vocabulary,
                 std::shared_ptr<DescriptorStage> stage = make_identity_stage());

  /// Empty when the left image is missing. Images that the two cameras took at different times are matched with the baseline that
  /// they had then (S3, S4); without readings there is no depth. Nor is there without the right image and a depth image, where no
  /// keyframe before of this flight shows the same things from elsewhere.
  Place extract(const Keyframe& keyframe);
  /// Keeps the left image as an earlier view, without a look at what it shows.
  void remember(const Keyframe& keyframe);
  /// Images of one instant, whatever was before. `R_LB`: gravity-aligned attitude of the body.
  Place extract(const StereoFrame& images, const Mat3& R_LB);

 private:
  /// `second`: there is another view, of `depths_`.
  Place extract(const StereoFrame& images, const Mat3& R_LB, bool second);
  std::optional<Pose<G, C0>> left_camera(const Keyframe& keyframe) const;
  bool look_right(const StereoFrame& images, const Pose<C1, C0>& T_C1C0);
  bool look_back(const Keyframe& keyframe, const Pose<G, C0>& T_GC);
  std::optional<double> nearer_than(const std::vector<KeyframeLandmark>& landmarks);
  bool has_depth_image(const StereoFrame& images) const;

  StereoRig rig_;
  std::optional<DepthReader> depth_;
  Vocabulary vocabulary_;
  std::shared_ptr<DescriptorStage> stage_;
  OrbExtractor orb_;
  OrbFeatures found_;
  SecondViewDepths depths_;
  EarlierViews earlier_;
};

}  // namespace fbvins
