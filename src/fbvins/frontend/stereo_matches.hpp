// SPDX-License-Identifier: Apache-2.0
// How many corners find their match along the epipolar lines of several rigs: which of them the images belong to. Pure
// function, any thread.
//
//   StereoMatches found = count_stereo_matches({{as_named, as_swapped}}, frames);
#pragma once

#include <span>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct StereoMatches {
  int corners = 0;           ///< of all left images
  std::vector<int> matched;  ///< of these, by each rig
};

/// Frames without a right image, or of another size, do not count. Cameras 0 and 1 of each rig.
StereoMatches count_stereo_matches(std::span<const StereoRig> rigs, std::span<const StereoFrame> frames);

}  // namespace fbvins
