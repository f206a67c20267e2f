// SPDX-License-Identifier: Apache-2.0
// Stereo matches without an epipolar constraint: by descriptor over the whole image, then patch alignment.
// Buffers are reused; one instance, one thread.
//
//   FreeStereo stereo;
//   std::vector<StereoPoint> points = stereo.match(rig, left_image, right_image, left_pyramid, right_pyramid);
#pragma once

#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/pyramid.hpp"

namespace fbvins {

class FreeStereo {
 public:
  FreeStereo();
  /// The inliers of one essential matrix, with a loose threshold, also of cameras one of which is upside down against the other.
  /// Of `rig` only the camera models are used.
  std::vector<StereoPoint> match(const StereoRig& rig, const Image& left_image, const Image& right_image, const Pyramid& left,
                                 const Pyramid& right);

 private:
  std::vector<StereoPoint> match_as(bool half_turned, const StereoRig& rig, const Image& right_image, const Pyramid& left,
                                    const Pyramid& right);

  OrbExtractor extractor_;
  OrbFeatures left_, right_;
  Rng rng_;
  Image turned_image_;
  Pyramid turned_right_;
  bool half_turned_ = false;  // as the images before
};

}  // namespace fbvins
