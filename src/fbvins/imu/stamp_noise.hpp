// SPDX-License-Identifier: Apache-2.0
// The noise of images' stamps, by when each image's tracks say that it was taken (docs/derivations/gyro_alignment.md,
// Y7, Y8). Pure functions, any thread.
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// What the second stamp of a pair of images is off by, where it shows, and its variance by the tracks' noise.
struct LateImage {
  Time from, to;
  double s, known_s2;
};

/// Standard deviation of a stamp, 0 where none shows. `late`: in the order of their images.
double stamp_sigma_s(const std::vector<LateImage>& late);

/// Noise of stamps up to this does not show where tracks are few.
inline constexpr double kUnseenStampNoise_s = 0.0007;

/// Between two images whose stamps have this standard deviation the readings turn and move by as much more or less (Y8). `rate`:
/// of the body, without bias; `velocity` in any frame.
void add_stamp_noise(ImuSegment& imu, const ImuNoise& noise, double stamp_sigma_s, const Vec3& rate_radps,
                     const Vec3& velocity_mps);

}  // namespace fbvins
