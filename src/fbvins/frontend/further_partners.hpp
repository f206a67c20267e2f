// SPDX-License-Identifier: Apache-2.0
// Where further cameras see the features that a rig's frontends follow: a camera can have more partners than the one that its
// frontend measures depth with. From a depth that is known, else by a search along the epipolar curve (klt_stereo.hpp); whatever
// frontend follows them. One instance, one thread.
//
//   FurtherPartners partners(rig, leading_groups(rig));
//   partners.match(packet.frame, features, stats);
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/frontend/klt_stereo.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class FurtherPartners {
 public:
  /// None.
  FurtherPartners() = default;
  /// For each group's first camera those that overlap with it (further_partners()).
  FurtherPartners(const StereoRig& rig, const std::vector<CameraGroup>& groups);

  /// Adds their observations of the features. Not of images that were taken at different times.
  void match(const StereoFrame& frame, std::vector<TrackedFeature>& features, FrontendStats& stats);

 private:
  struct Partner {
    CameraGroup of;  ///< the camera that leads, and the one that its frontend measures depth with
    int camera;
    KltStereoMatcher matcher;
    std::unordered_map<TrackId, double> inverse_depths = {};  ///< that were found, in the image before
  };
  void match(Partner& partner, std::vector<TrackedFeature>& features, FrontendStats& stats);
  std::optional<double> inverse_depth(const Partner& partner, const TrackedFeature& feature) const;
  bool has_images(const Partner& partner, const StereoFrame& frame);

  StereoRig rig_;
  std::vector<Partner> partners_;
  std::vector<Pyramid> images_;  ///< by camera; of those that did not come, or that nobody needs, empty
  KltTemplate patch_;
};

}  // namespace fbvins
