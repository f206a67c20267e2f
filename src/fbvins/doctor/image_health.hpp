// SPDX-License-Identifier: Apache-2.0
// What is wrong with the images themselves: repeated ones, things that hang in view, blur. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"

namespace fbvins {

/// Images repeated to the last bit, and one image as both left and right.
std::vector<Finding> check_repeated(const RepeatedImages& repeated);

struct FixedFeatures {
  double share = 0;                 ///< of the features that stay where they are while the others move
  double dots = 0;                  ///< of all features, those that look like spots of light
  int pairs = 0;                    ///< of images in which others moved enough to tell
  std::set<std::int64_t> ids = {};  ///< of those that stayed
};
/// The readings tell only whether the rig turned at all: a few features that move count for more then.
FixedFeatures measure_fixed(const Evidence& evidence, const ImuSeries& imu);
std::optional<Finding> check_fixed(const FixedFeatures& fixed);

struct Blur {
  double exposure_s = 0, sigma_s = 0;  ///< that the loss of sharpness along the motion tells
  double speed_pxps = 0;               ///< exceeded in a tenth of the images
  int images = 0;                      ///< that moved enough and in one direction
  double length_px() const { return exposure_s * speed_pxps; }
};
Blur measure_blur(const Evidence& evidence);
std::optional<Finding> check_blur(const Blur& blur);

}  // namespace fbvins
