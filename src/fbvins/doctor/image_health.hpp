// SPDX-License-Identifier: Apache-2.0
// What is wrong with the images themselves: repeated ones, things that are fixed in view. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "fbvins/checkup/finding.hpp"
#include "fbvins/doctor/evidence.hpp"
#include "fbvins/doctor/imu_series.hpp"

namespace fbvins {

/// Images repeated to the last bit, and the same image as left and right.
std::vector<Finding> check_repeated(const RepeatedImages& repeated);

struct FixedFeatures {
  double share = 0;                 ///< of the features that stay where they are while the others move
  double dots = 0;                  ///< of all features, those that look like spots of light
  int pairs = 0;                    ///< of images in which others moved enough to judge by
  std::set<std::int64_t> ids = {};  ///< of those that stayed
};
/// `imu` is only used for the amount of rotation: if the rig rotated enough, few moving features suffice.
FixedFeatures measure_fixed(const Evidence& evidence, const ImuSeries& imu);
std::optional<Finding> check_fixed(const FixedFeatures& fixed);

}  // namespace fbvins
