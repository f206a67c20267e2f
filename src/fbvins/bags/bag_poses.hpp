// SPDX-License-Identifier: Apache-2.0
// Private: a trajectory that a bag holds on a topic of poses. Any thread.
#pragma once

#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

/// Of geometry_msgs/PoseStamped, PoseWithCovarianceStamped or TransformStamped, or nav_msgs/Odometry, in order of the messages'
/// own stamps, each stamp once. An empty topic is the only one of these types, or /ground_truth; an error lists what there is.
Result<Trajectory<W>> read_bag_poses(const std::string& path, const std::string& topic);

}  // namespace fbvins
