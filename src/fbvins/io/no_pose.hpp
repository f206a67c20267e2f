// SPDX-License-Identifier: Apache-2.0
// Private: what is said of a flight without a single pose, or with poses most of which are not good. Pure functions.
//
//   no_pose_sentence({{"initialising/imu_gap", 340}})
//     -> "no pose in any of 340 images: health is initialising/imu_gap in all of them (docs/troubleshooting.md)"
#pragma once

#include <map>
#include <string>

namespace fbvins {

/// The health and reason of most images, with their share.
std::string no_pose_sentence(const std::map<std::string, int>& images_by_health);
/// The same of the poses, where fewer than half of them are good, or where the estimator started anew after a loss; empty
/// otherwise.
std::string few_good_sentence(const std::map<std::string, int>& images_by_health, int restarts = 0);

}  // namespace fbvins
