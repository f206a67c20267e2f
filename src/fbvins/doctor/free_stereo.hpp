// SPDX-License-Identifier: Apache-2.0
// Points of the left image found in the right one wherever they are: by descriptor over the whole image, then patch alignment.
// Buffers are reused; one instance, one thread.
//
//   FreeStereo stereo;
//   std::vector<StereoPoint> points = stereo.match(left, right);
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
  /// Those that agree with some epipolar geometry of the whole image, loosely: whichever it is.
  std::vector<StereoPoint> match(const StereoRig& rig, const Image& left_image, const Image& right_image, const Pyramid& left,
                                 const Pyramid& right);

 private:
  OrbExtractor extractor_;
  OrbFeatures left_, right_;
  Rng rng_;
};

}  // namespace fbvins
