// SPDX-License-Identifier: Apache-2.0
// The noise of images' stamps, by when each image's tracks say that it was taken (docs/derivations/gyro_alignment.md, Y7). Pure
// functions, any thread.
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"

namespace fbvins {

/// What the second stamp of a pair of images is off by, where it shows, and its variance by the tracks' noise.
struct LateImage {
  Time from, to;
  double s, known_s2;
};

/// Standard deviation of a stamp, 0 where none shows. `late`: in the order of their images.
double stamp_sigma_s(const std::vector<LateImage>& late);

}  // namespace fbvins
